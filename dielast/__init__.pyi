"""The public names of dielast and the modules that hold them; `__init__.py` reads this list, and so do type checkers (SPEC 1)."""

from dielast._version import __version__ as __version__
from dielast.errors import (
    DielastError as DielastError,
)
from dielast.errors import (
    DielastWarning as DielastWarning,
)
from dielast.errors import (
    InputError as InputError,
)
from dielast.errors import (
    NumericsError as NumericsError,
)
from dielast.export.card import export_card as export_card
from dielast.export.conventions import CardOptions as CardOptions
from dielast.handover.material_draws import read_draws as read_draws
from dielast.handover.material_file import read_material as read_material
from dielast.handover.material_file import write_material as write_material
from dielast.material.material import Breakdown as Breakdown
from dielast.material.material import Material as Material
from dielast.material.scatter import (
    NormalScatter as NormalScatter,
)
from dielast.material.scatter import (
    Sample as Sample,
)
from dielast.material.scatter import (
    WeibullScatter as WeibullScatter,
)
from dielast.material.scatter import (
    draw_sample as draw_sample,
)
from dielast.material.scatter import (
    interval as interval,
)
from dielast.material.shift import WLF as WLF
from dielast.material.shift import Arrhenius as Arrhenius
from dielast.material.shift import NoShift as NoShift
from dielast.material.shift import ShiftTable as ShiftTable
from dielast.material.spectrum import Spectrum as Spectrum
from dielast.material.springs import Gent as Gent
from dielast.mechanics.load import Step as Step
from dielast.mechanics.load import Track as Track
from dielast.mechanics.load import Waveform as Waveform
from dielast.mechanics.stability import TimeScale as TimeScale
from dielast.plots.mastercurve import plot_master_curve as plot_master_curve
from dielast.plots.spectrum import plot_spectrum as plot_spectrum
from dielast.relaxation.continuous import ContinuousSpectrum as ContinuousSpectrum
from dielast.relaxation.continuous import continuous_spectrum as continuous_spectrum
from dielast.relaxation.creep import fit_creep as fit_creep
from dielast.relaxation.fit import SpectrumFit as SpectrumFit
from dielast.relaxation.fit import fit_spectrum as fit_spectrum
from dielast.relaxation.interconversion import (
    RetardationSpectrum as RetardationSpectrum,
)
from dielast.relaxation.interconversion import (
    relaxation_from_retardation as relaxation_from_retardation,
)
from dielast.relaxation.interconversion import (
    retardation_from_relaxation as retardation_from_relaxation,
)
from dielast.relaxation.oscillation import fit_oscillation as fit_oscillation
from dielast.relaxation.reduce import Reduction as Reduction
from dielast.relaxation.reduce import reduce_spectrum as reduce_spectrum
from dielast.simulate.actuate import ActuationHistory as ActuationHistory
from dielast.simulate.actuate import actuate as actuate
from dielast.simulate.creep import creep as creep
from dielast.simulate.failure_map import (
    FailureMap as FailureMap,
)
from dielast.simulate.failure_map import (
    failure_map as failure_map,
)
from dielast.simulate.failure_map import (
    plan_failure_map as plan_failure_map,
)
from dielast.simulate.failure_map import (
    solve_map as solve_map,
)
from dielast.simulate.lifetime import fit_lifetime as fit_lifetime
from dielast.simulate.membrane import MembraneHistory as MembraneHistory
from dielast.simulate.relax import relax as relax
from dielast.simulate.voltage import VoltageStep as VoltageStep
from dielast.superposition.bootstrap import MasterCurveDraws as MasterCurveDraws
from dielast.superposition.bootstrap import bootstrap_master_curve as bootstrap_master_curve
from dielast.superposition.mastercurve import MasterCurve as MasterCurve
from dielast.superposition.mastercurve import build_master_curve as build_master_curve
from dielast.superposition.measurement import (
    CreepCurve as CreepCurve,
)
from dielast.superposition.measurement import (
    FrequencySweep as FrequencySweep,
)
from dielast.superposition.measurement import (
    RelaxationCurve as RelaxationCurve,
)
