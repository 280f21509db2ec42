"""`dielast lifetime`."""

from dielast.commands.command import Command

LIFETIME = Command(
    name="lifetime",
    package=__name__,
    help="Measured failures, and what has not failed yet -> the breakdown field or damage of a material, with scatter and draws.",
    short_help="Measured failures -> breakdown or damage, with scatter.",
    files=(
        *("parameters.csv", "specimens.csv", "life.csv", "laws.csv", "lines.csv", "plan.csv"),
        *("material.toml", "draws.csv"),
    ),
)
