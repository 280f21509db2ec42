"""dielast: dielectric elastomers from relaxation measurements to time to failure.

Everything public is imported from here, `from dielast import build_master_curve`, and loaded when it is first used. Functions that
are imported from here refuse arguments of a wrong type; within the package, where callers pass what they have checked, they do not.

The words of this package:

- recipe: a TOML file that says what to run; its `kind` is the command that runs it.
- case: a specimen or a film under a load history. Cases that a recipe sweeps are computed together, as one axis of arrays.
- cell: a case of a failure map, at one voltage, prestretch and temperature.
- curve: a measurement at one temperature: relaxation, creep or a frequency sweep. A test at several temperatures has several
  curves.
- master curve: all curves, shifted along the time axis to the reference temperature.
- shift factor: relaxation times at a temperature over those at the reference temperature; stated as log10.
- spectrum: the relaxation times and shear moduli of all branches.
- branch: a Maxwell element, a spring and a damper in series; all branches are parallel to the equilibrium spring.
- material point: the state of a case, homogeneous and in plane stress: stretches, and a viscous stretch for each branch and axis.
- active, passive: the part of a film under its electrode, and the film around it, in a frame or between bars; many material points.
- stretch: length over undeformed length; relative stretch: over the length after the prestretch, when the voltage begins.
- nominal: over the undeformed section or thickness, as in nominal stress and nominal field; true: over the present one.
- step: a part of a load history as a user states it: a target with a rate or a duration, a hold, a waveform or a table; a piece is
  the same for the solver, for both axes and the field.
- span: a part of a piece with a smooth load, whose value and rate are in closed form.
- stride: one time step of the integrator for all cases that advance together; step sizes differ between cases.
- event: breakdown, pull-in, damage or loss of tension; a predicted failure is a result, not an error.
- goal: a stretch or an area strain that a film of a design must reach at a time under a constant voltage.
- draw: a material or a film with other random noise or scatter; intervals are quantiles of the results of all draws.
- batch: cases with histories of one shape that one process solves together; a chunk is a batch of cells or films of a grid.
"""

from __future__ import annotations

TYPE_CHECKING = False  # typing, functools and types take longer than all else here, and Ctrl-C meanwhile is a traceback
__version__ = "0.1.0"

if TYPE_CHECKING:  # the public names, of which this is the only list: type checkers read it, and so does `_modules`
    from typing import Any

    from dielast.base.errors import (
        DielastError as DielastError,
        DielastWarning as DielastWarning,
        InputError as InputError,
        NumericsError as NumericsError,
    )
    from dielast.calibration.comparison import Comparison as Comparison
    from dielast.calibration.experiment import MeasuredTest as MeasuredTest
    from dielast.calibration.parameters import Free as Free
    from dielast.calibration.result import Calibration as Calibration, Intervals as Intervals, calibrate as calibrate
    from dielast.calibration.voltage import VoltageTest as VoltageTest
    from dielast.handover.export.card import export_card as export_card
    from dielast.handover.export.code import CardOptions as CardOptions
    from dielast.handover.material_draws import read_draws as read_draws
    from dielast.handover.material_file import read_material as read_material, write_material as write_material
    from dielast.material.breakdown import PowerBreakdown as PowerBreakdown
    from dielast.material.damage import InversePower as InversePower
    from dielast.material.dielectric import VACUUM_PERMITTIVITY as VACUUM_PERMITTIVITY, Leakage as Leakage
    from dielast.material.intervals import interval as interval
    from dielast.material.material import Breakdown as Breakdown, Material as Material
    from dielast.material.measurement import (
        CreepCurve as CreepCurve,
        FrequencySweep as FrequencySweep,
        RelaxationCurve as RelaxationCurve,
    )
    from dielast.material.ramp import without_ramp as without_ramp
    from dielast.material.scatter import (
        FilmScatter as FilmScatter,
        NormalScatter as NormalScatter,
        Sample as Sample,
        WeibullScatter as WeibullScatter,
        draw_sample as draw_sample,
    )
    from dielast.material.shift import (
        WLF as WLF,
        Arrhenius as Arrhenius,
        NoShift as NoShift,
        ShiftTable as ShiftTable,
        VogelFulcherTammann as VogelFulcherTammann,
    )
    from dielast.material.spectrum import Spectrum as Spectrum
    from dielast.material.springs import (
        ArrudaBoyce as ArrudaBoyce,
        Gent as Gent,
        GentI2 as GentI2,
        MooneyRivlin as MooneyRivlin,
        NeoHookean as NeoHookean,
        Ogden as Ogden,
        Yeoh as Yeoh,
    )
    from dielast.mechanics.load import (
        ChargeStep as ChargeStep,
        FilmStep as FilmStep,
        Programme as Programme,
        Repeat as Repeat,
        Step as Step,
        Track as Track,
        VoltageStep as VoltageStep,
        Waveform as Waveform,
    )
    from dielast.mechanics.stability import TimeScale as TimeScale
    from dielast.plots.mastercurve import plot_master_curve as plot_master_curve
    from dielast.plots.sensitivity import plot_sensitivity as plot_sensitivity
    from dielast.plots.spectrum import plot_spectrum as plot_spectrum
    from dielast.readings.photographs.camera import Camera as Camera
    from dielast.readings.photographs.outline import Outline as Outline, find_outline as find_outline
    from dielast.readings.photographs.series import Stretches as Stretches, measure_electrode as measure_electrode
    from dielast.relaxation.checks import Plateaus as Plateaus
    from dielast.relaxation.continuous import ContinuousSpectrum as ContinuousSpectrum, continuous_spectrum as continuous_spectrum
    from dielast.relaxation.creep import fit_creep as fit_creep
    from dielast.relaxation.fit import fit_oscillation as fit_oscillation, fit_spectrum as fit_spectrum
    from dielast.relaxation.interconversion import (
        RetardationSpectrum as RetardationSpectrum,
        relaxation_from_retardation as relaxation_from_retardation,
        retardation_from_relaxation as retardation_from_relaxation,
    )
    from dielast.relaxation.reduce import Reduction as Reduction, reduce_spectrum as reduce_spectrum
    from dielast.relaxation.result import SpectrumFit as SpectrumFit
    from dielast.relaxation.superposition.bootstrap import (
        MasterCurveDraws as MasterCurveDraws,
        bootstrap_master_curve as bootstrap_master_curve,
    )
    from dielast.relaxation.superposition.mastercurve import build_master_curve as build_master_curve
    from dielast.relaxation.superposition.result import MasterCurve as MasterCurve
    from dielast.simulate.actuate import actuate as actuate
    from dielast.simulate.actuation_history import ActuationHistory as ActuationHistory
    from dielast.simulate.design import Design as Design, design as design
    from dielast.simulate.design_plan import Goal as Goal
    from dielast.simulate.failure_map import (
        FailureMap as FailureMap,
        HeldVoltages as HeldVoltages,
        failure_map as failure_map,
        plan_failure_map as plan_failure_map,
        solve_map as solve_map,
    )
    from dielast.simulate.film_setup import Film as Film
    from dielast.simulate.lifetime import fit_lifetime as fit_lifetime
    from dielast.simulate.limits import Limits as Limits, film_limits as film_limits
    from dielast.simulate.membrane import MembraneHistory as MembraneHistory, creep as creep, relax as relax
    from dielast.simulate.options import Circuit as Circuit, Failure as Failure, Solver as Solver
    from dielast.simulate.output import Output as Output
    from dielast.simulate.sensitivity import (
        LifeElasticities as LifeElasticities,
        LifeShares as LifeShares,
        life_sensitivity as life_sensitivity,
    )


_MODULES: dict[str, str] = {}


def _modules() -> dict[str, str]:
    """The module of each public name, read from the imports above when first needed."""
    if not _MODULES:
        import ast

        source = __spec__.loader.get_source(__name__)  # type: ignore[union-attr]
        imports = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
        _MODULES.update({alias.name: str(node.module) for node in imports for alias in node.names if alias.asname})
    return _MODULES


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return __dir__()
    if name.startswith("__") or name not in _modules():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    public = globals()[name] = _public(name)
    return public


def _public(name: str) -> Any:
    """What a public name stands for; a function with a check of its arguments."""
    from importlib import import_module
    from types import FunctionType

    public = getattr(import_module(_modules()[name]), name)
    if not isinstance(public, FunctionType):
        return public
    from dielast.material.argument_types import checked

    function = checked(public)
    function.__module__ = __name__  # where pickle finds it
    return function


def __dir__() -> list[str]:
    return sorted(["__version__", *_modules()])
