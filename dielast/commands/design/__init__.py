"""`dielast design`."""

from dielast.commands.command import Command

DESIGN = Command(
    name="design",
    package=__name__,
    help="Films -> the voltage that takes each to a goal at a time, and how long it lives under it.",
    short_help="Films, a goal -> voltage, life, the best film first.",
    files=("design.csv",),
    can_share=True,
)
