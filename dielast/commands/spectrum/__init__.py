"""`dielast spectrum`."""

from dielast.commands.command import Command

_CARDS = (
    *("material.inp", "material.mac", "material.feb", "material.mfront"),
    *(f"material-comsol-{name}.txt" for name in ("parameters", "branches-energy-factor", "branches-shear-modulus")),
    *("material-comsol-shift.txt", "material-comsol-notes.txt"),
)
SPECTRUM = Command(
    name="spectrum",
    package=__name__,
    help="Master curve -> discrete relaxation spectrum and material file.",
    short_help="Master curve -> spectrum, material file.",
    files=("spectrum.csv", "fit.csv", "continuous-spectrum.csv", "reduction.csv", "material.toml", "draws.csv", *_CARDS),
)
