"""The time-temperature shift laws, one module each."""

from __future__ import annotations

from dielast.material.law import Registry
from dielast.material.shift.arrhenius import GAS_CONSTANT, Arrhenius, kelvin
from dielast.material.shift.law import ShiftLaw
from dielast.material.shift.none import NoShift
from dielast.material.shift.table import ShiftTable
from dielast.material.shift.wlf import WLF

__all__ = ["GAS_CONSTANT", "SHIFTS", "WLF", "Arrhenius", "NoShift", "ShiftLaw", "ShiftTable", "kelvin"]

SHIFTS: Registry[type[ShiftLaw]] = Registry("shift law", WLF, Arrhenius, ShiftTable, NoShift)
