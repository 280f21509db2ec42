"""The time-temperature shift laws, one module each."""

from dielast.base.registry import Registry
from dielast.material.shift.arrhenius import GAS_CONSTANT as GAS_CONSTANT, Arrhenius as Arrhenius, kelvin as kelvin
from dielast.material.shift.law import NoShift as NoShift, ShiftLaw as ShiftLaw
from dielast.material.shift.table import ShiftTable as ShiftTable
from dielast.material.shift.vft import VogelFulcherTammann as VogelFulcherTammann
from dielast.material.shift.wlf import WLF as WLF

SHIFTS: Registry[type[ShiftLaw]] = Registry(
    "shift law", WLF, Arrhenius, ShiftTable, NoShift, VogelFulcherTammann, group="dielast.shift", base=ShiftLaw
)
