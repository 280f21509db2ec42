"""`dielast failure-map`."""

from dielast.commands.command import Command

FAILURE_MAP = Command(
    name="failure-map",
    package=__name__,
    help="Time to breakdown and to pull-in over voltage, prestretch and temperature.",
    short_help="Voltages, prestretches -> time to failure.",
    files=(
        *("failure-map.csv", "fit.csv", "sensitivity.csv"),
        *(f"{name}.{form}" for name in ("operating-map", "sensitivity") for form in ("png", "svg", "pdf")),
    ),
    can_share=True,
)
