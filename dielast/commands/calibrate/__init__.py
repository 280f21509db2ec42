"""`dielast calibrate`."""

from dielast.commands.command import Command

CALIBRATE = Command(
    name="calibrate",
    package=__name__,
    help="Tests of a testing machine -> the material's constants with intervals and verdicts, and a material file with draws.",
    short_help="Tests of any kind -> material file with intervals.",
    files=(
        *("parameters.csv", "tests.csv", "correlations.csv", "residuals.csv", "profiles.csv", "laws.csv", "next_tests.csv"),
        *("material.toml", "draws.csv"),
    ),
)
