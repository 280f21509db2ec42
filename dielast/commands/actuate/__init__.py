"""`dielast actuate`."""

from dielast.commands.command import Command

ACTUATE = Command(
    name="actuate",
    package=__name__,
    recipe="ActuateRecipe",
    help="Voltage history -> stretch of a prestretched film; breakdown, pull-in, loss of tension.",
    short_help="Voltage history -> stretch of a film, and its failure.",
    files=("actuate.csv", "events.csv", "cycles.csv", "cases.csv", "profile.csv", "profile.png", "profile.svg", "profile.pdf", "sensitivity.csv", "sensitivity.png", "sensitivity.svg", "sensitivity.pdf"),
    can_share=True,
)
