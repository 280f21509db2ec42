"""`dielast design`."""

from dielast.commands.command import Command

DESIGN = Command(
    name="design",
    package=__name__,
    help="Films -> the voltage that takes each film to a goal at a time, and the life of the film under it.",
    short_help="Films, a goal -> voltage, life, the best film first.",
    files=("design.csv",),
    can_share=True,
)
