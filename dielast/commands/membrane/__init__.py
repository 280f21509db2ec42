"""`dielast relax` and `dielast creep`."""

from dielast.commands.command import Command

RELAX = Command(
    name="relax",
    package=__name__,
    recipe="RelaxRecipe",
    help="Prescribed stretch -> stress.",
    short_help="Prescribed stretch -> stress.",
    files=("relax.csv", "cycles.csv", "cases.csv"),
    can_share=True,
)
CREEP = Command(
    name="creep",
    package=__name__,
    recipe="CreepRecipe",
    help="Prescribed force or nominal stress -> stretch.",
    short_help="Prescribed force or stress -> stretch.",
    files=("creep.csv", "cycles.csv", "cases.csv"),
    can_share=True,
)
