"""`dielast relax` and `dielast creep`."""

from dielast.commands.command import Command


def _command(name: str, text: str, short: str) -> Command:
    files = (f"{name}.csv", "events.csv", "cycles.csv", "cases.csv")
    return Command(name, __name__, text, short, files, can_share=True)


RELAX = _command("relax", "Prescribed stretch -> stress.", "Prescribed stretch -> stress.")
CREEP = _command("creep", "Prescribed force or nominal stress -> stretch.", "Prescribed force or stress -> stretch.")
