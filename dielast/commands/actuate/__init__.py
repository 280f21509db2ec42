"""`dielast actuate`."""

from dielast.commands.command import Command

ACTUATE = Command(
    name="actuate",
    package=__name__,
    help="Voltage history -> stretch of a prestretched film; breakdown, pull-in, loss of tension.",
    short_help="Voltage history -> stretch of a film, and its failure.",
    files=(
        *("actuate.csv", "events.csv", "cycles.csv", "cases.csv"),
        *(f"{name}.{form}" for name in ("profile", "limits", "sensitivity") for form in ("csv", "png", "svg", "pdf")),
    ),
    can_share=True,
)
