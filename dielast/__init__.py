"""dielast: dielectric elastomers from relaxation measurements to time to failure.

Everything public is imported from here, `from dielast import build_master_curve`, and loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from dielast._version import __version__

if TYPE_CHECKING:
    from dielast.errors import DielastError, DielastWarning, InputError, NumericsError
    from dielast.export.card import export_card
    from dielast.export.conventions import CardOptions
    from dielast.handover.material_draws import read_draws
    from dielast.handover.material_file import read_material, write_material
    from dielast.material.material import Breakdown, Material
    from dielast.material.measurement import CreepCurve, FrequencySweep, RelaxationCurve
    from dielast.material.scatter import NormalScatter, Sample, WeibullScatter, draw_sample, interval
    from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftTable
    from dielast.material.spectrum import Spectrum
    from dielast.material.springs import Gent
    from dielast.mechanics.load import Step, Track, Waveform
    from dielast.mechanics.stability import TimeScale
    from dielast.plots.mastercurve import plot_master_curve
    from dielast.plots.spectrum import plot_spectrum
    from dielast.relaxation.continuous import ContinuousSpectrum, continuous_spectrum
    from dielast.relaxation.creep import fit_creep
    from dielast.relaxation.fit import SpectrumFit, fit_spectrum
    from dielast.relaxation.interconversion import (
        RetardationSpectrum,
        relaxation_from_retardation,
        retardation_from_relaxation,
    )
    from dielast.relaxation.oscillation import fit_oscillation
    from dielast.relaxation.reduce import Reduction, reduce_spectrum
    from dielast.simulate.actuate import ActuationHistory, actuate
    from dielast.simulate.creep import creep
    from dielast.simulate.failure_map import FailureMap, failure_map, plan_failure_map, solve_map
    from dielast.simulate.lifetime import fit_lifetime
    from dielast.simulate.membrane import MembraneHistory
    from dielast.simulate.relax import relax
    from dielast.simulate.voltage import VoltageStep
    from dielast.superposition.bootstrap import MasterCurveDraws, bootstrap_master_curve
    from dielast.superposition.mastercurve import MasterCurve, build_master_curve

_HOME = {
    "superposition.bootstrap": ("MasterCurveDraws", "bootstrap_master_curve"),
    "relaxation.continuous": ("ContinuousSpectrum", "continuous_spectrum"),
    "relaxation.creep": ("fit_creep",),
    "relaxation.interconversion": ("RetardationSpectrum", "relaxation_from_retardation", "retardation_from_relaxation"),
    "superposition.mastercurve": ("MasterCurve", "build_master_curve"),
    "material.measurement": ("CreepCurve", "FrequencySweep", "RelaxationCurve"),
    "relaxation.oscillation": ("fit_oscillation",),
    "relaxation.reduce": ("Reduction", "reduce_spectrum"),
    "relaxation.fit": ("SpectrumFit", "fit_spectrum"),
    "material.scatter": ("NormalScatter", "Sample", "WeibullScatter", "draw_sample", "interval"),
    "errors": ("DielastError", "DielastWarning", "InputError", "NumericsError"),
    "export.card": ("export_card",),
    "export.conventions": ("CardOptions",),
    "material.springs": ("Gent",),
    "mechanics.load": ("Step", "Track", "Waveform"),
    "material.material": ("Breakdown", "Material"),
    "plots.mastercurve": ("plot_master_curve",),
    "plots.spectrum": ("plot_spectrum",),
    "material.spectrum": ("Spectrum",),
    "handover.material_draws": ("read_draws",),
    "handover.material_file": ("read_material", "write_material"),
    "material.shift": ("WLF", "Arrhenius", "NoShift", "ShiftTable"),
    "simulate.actuate": ("ActuationHistory", "actuate"),
    "simulate.creep": ("creep",),
    "simulate.failure_map": ("FailureMap", "failure_map", "plan_failure_map", "solve_map"),
    "simulate.lifetime": ("fit_lifetime",),
    "simulate.membrane": ("MembraneHistory",),
    "simulate.relax": ("relax",),
    "simulate.voltage": ("VoltageStep",),
    "mechanics.stability": ("TimeScale",),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "WLF",
    "ActuationHistory",
    "Arrhenius",
    "Breakdown",
    "CardOptions",
    "ContinuousSpectrum",
    "CreepCurve",
    "DielastError",
    "DielastWarning",
    "FailureMap",
    "FrequencySweep",
    "Gent",
    "InputError",
    "MasterCurve",
    "MasterCurveDraws",
    "Material",
    "MembraneHistory",
    "NoShift",
    "NormalScatter",
    "NumericsError",
    "Reduction",
    "RelaxationCurve",
    "RetardationSpectrum",
    "Sample",
    "ShiftTable",
    "Spectrum",
    "SpectrumFit",
    "Step",
    "TimeScale",
    "Track",
    "VoltageStep",
    "Waveform",
    "WeibullScatter",
    "__version__",
    "actuate",
    "bootstrap_master_curve",
    "build_master_curve",
    "continuous_spectrum",
    "creep",
    "draw_sample",
    "export_card",
    "failure_map",
    "fit_creep",
    "fit_lifetime",
    "fit_oscillation",
    "fit_spectrum",
    "interval",
    "plan_failure_map",
    "plot_master_curve",
    "plot_spectrum",
    "read_draws",
    "read_material",
    "reduce_spectrum",
    "relax",
    "relaxation_from_retardation",
    "retardation_from_relaxation",
    "solve_map",
    "write_material",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
