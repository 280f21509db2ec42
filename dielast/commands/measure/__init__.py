"""`dielast measure`."""

from dielast.commands.command import Command

MEASURE = Command(
    name="measure",
    package=__name__,
    help="Photographs of an electrode -> stretches over time with standard errors.",
    short_help="Photographs of an electrode -> stretches over time.",
    files=("electrode.csv", *(f"photographs.{form}" for form in ("png", "svg", "pdf"))),
    can_share=True,
)
