"""`dielast mastercurve`."""

from dielast.commands.command import Command

MASTERCURVE = Command(
    name="mastercurve",
    package=__name__,
    help="Relaxation tests, creep tests or frequency sweeps at several temperatures -> shift factors, shift law, master curve.",
    short_help="Tests at several temperatures -> shift factors, master curve.",
    files=("shift-factors.csv", "mastercurve.csv", "draws.csv", "draw-laws.csv", "draw-curves.csv"),
)
