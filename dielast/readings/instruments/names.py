"""The names of columns in instruments' exports, by the role of a column in a master curve."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Literal

from dielast.io.cells import is_number
from dielast.io.text_table import MeasuredTable

Deformation = Literal["tension", "shear"]

# the better choice first: the time of a step is preferred to that of the test
ROLES: Mapping[str, tuple[str, ...]] = {
    "temperature": ("temperature", "sample temperature", "temp.", "temp", "temperatur"),
    "time": ("step time", "interval time", "time", "segment time", "intervallzeit", "zeit"),
    "frequency": ("frequency", "freq.", "frequenz"),
    "angular_frequency": ("angular frequency", "ang. frequency", "omega", "ω", "kreisfrequenz"),
    "storage": ("storage modulus", "g'", "e'", "speichermodul"),
    "loss": ("loss modulus", "g''", "e''", "verlustmodul"),
    "tan_delta": (
        "tan(delta)",
        "tan delta",
        "tan(δ)",
        "tan δ",
        "tan d",
        "tan(d)",
        "loss factor",
        "damping factor",
        "verlustfaktor",
    ),
    "complex_modulus": ("complex modulus", "|g*|", "|e*|", "g*", "e*", "complex shear modulus", "komplexer modul"),
    "complex_viscosity": ("complex viscosity", "|eta*|", "eta*", "|η*|", "η*", "komplexe viskosität"),
    "modulus": ("relaxation modulus", "modulus", "g(t)", "e(t)", "relaxationsmodul"),
    "compliance": ("creep compliance", "compliance", "j(t)", "d(t)", "kriechnachgiebigkeit", "nachgiebigkeit"),
    "strain": ("strain", "shear strain", "extensional strain", "tensile strain", "deformation", "scherdeformation"),
    "stress": ("stress", "shear stress", "extensional stress", "tensile stress", "schubspannung"),
}
ANGULAR = ROLES["angular_frequency"]
# names of a single letter, for which case matters
_LETTERS = {"T": "temperature", "t": "time", "f": "frequency", "w": "angular_frequency"}

_TENSION = re.compile(r"\b(young|tensile|extensional)|^\|?e('|\*|\()")
_SHEAR = re.compile(r"\bshear (strain|stress|modulus)|^\|?g('|\*|\()|scher|schub")


def plain(name: str) -> str:
    """A column's name in the form of `ROLES`: lower case, single blanks, primes as apostrophes."""
    text = re.sub(r"[\s_]+", " ", name).strip().casefold()
    return re.sub("[\u2032\u2019\u00b4`]", "'", text).replace('"', "''").replace("\u2033", "''")


def columns_by_role(table: MeasuredTable) -> dict[str, int]:
    """The number (from 1) of the column for each role for which `table` has readings."""
    known = {plain(name): index for index, name in reversed(list(enumerate(table.names))) if is_filled(table, index)}
    columns = {role: known[name] + 1 for role, names in ROLES.items() for name in reversed(names) if name in known}
    for index, name in enumerate(table.names):
        if name in _LETTERS and is_filled(table, index):
            columns.setdefault(_LETTERS[name], index + 1)
    return columns


def is_filled(table: MeasuredTable, index: int) -> bool:
    """Whether the column at `index` contains a number."""
    return any(is_number(cell, table.decimal) for cell in table.cells[index])


def deformation_of(names: Sequence[str]) -> Deformation | None:
    """Tension or shear, if the names of the columns state it."""
    texts = [plain(name) for name in names]
    tension, shear = (any(pattern.search(text) for text in texts) for pattern in (_TENSION, _SHEAR))
    return None if tension == shear else "tension" if tension else "shear"
