"""`dielast failure-map`."""

from dielast.commands.command import Command

FAILURE_MAP = Command(
    name="failure-map",
    package=__name__,
    recipe="FailureMapRecipe",
    help="Time to breakdown and to pull-in over voltage, prestretch and temperature.",
    short_help="Voltages, prestretches -> time to failure.",
    files=("failure-map.csv", "fit.csv", "operating-map.png", "operating-map.svg", "operating-map.pdf"),
    can_share=True,
)
