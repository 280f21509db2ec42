"""From a creep compliance, shifted to one temperature, to the discrete relaxation spectrum, by way of the retardation spectrum.

No curve of finite length distinguishes a fluid from a solid with far slower processes, and noise alone gives half of all solids a
small fluidity. A material is therefore taken as a solid unless its flow is significant by an F test at equal smoothing. The flow
must be significant beside processes within the length of the curve, and beside processes of up to ten times that length, because
the compliance due to slower processes also rises in proportion to time.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import warn
from dielast.material.measurement_kind import CREEP
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats
from dielast.relaxation.checks import Plateaus, TimeRange
from dielast.relaxation.interconversion import RetardationSpectrum, relaxation_from_retardation, retardation_from_relaxation
from dielast.relaxation.nnls import EVEN, Known, Solution, Total, WeightedCurve, fit_strengths
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.task import LEVEL_SLOPE, FitTask

LEAST_GLASSY = 0.01  # of the first compliance: a smaller glassy compliance cannot be measured
FLOWS = -0.8  # d log(1/J)/d log t: a compliance that rises more steeply is clearly that of a melt
LEAST_CHANCE = 1e-4  # probability that noise makes the flow of a solid as significant
EXACT = 1e-9  # relative rounding error of values in tables
SLOWER = 10.0  # times the length of the curve, at which processes still have an effect on it


def fit_creep(
    reduced_time: ArrayLike,
    creep_compliance: ArrayLike,
    *,
    branches: int | None = None,
    retardation_time: TimeRange = (None, None),
    plateaus: Plateaus = Plateaus(),
    keep: int | None = None,
    flows: bool | None = None,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve of tensile creep compliance (1/Pa) over `reduced_time` (s), (n,) in any order.

    `branches` retardation processes (by default as many as in `fit_spectrum`), a glassy compliance and a fluidity, none negative,
    are fitted to the relative error with the smoothness that the data support, and converted exactly
    (`relaxation_from_retardation`). Processes of strength 0 drop out, and a material that flows has one branch more.
    `retardation_time` is the shortest and the longest time in s, each chosen as in `fit_spectrum` if it is None. Both moduli of the
    `plateaus` are fitted by default. `keep` truncates to the slowest branches. `flows` says whether there is a fluidity if the
    equilibrium modulus is not stated; by default there is one if it is significant.

    Raises `InputError` for points or arguments that allow no fit. Warns as `fit_spectrum` does, if the curve does not show whether
    the material flows, and if it does not show the glassy compliance, so that the fastest branch is a guess.
    """
    columns = (reduced_time, creep_compliance)
    task = FitTask(CREEP, columns, branches, retardation_time, plateaus, keep)
    curve, softest, prescribed = task.curve, task.plateau, task.equilibrium
    process_time, known, total, is_open = _what_to_fit(task, flows)
    solution = _with_glassy(curve, process_time, known, total)
    retardation = RetardationSpectrum(process_time, solution.strength, *solution.constants.tolist())
    if prescribed == 0 and retardation.fluidity == 0:  # the curve shows no flow: a melt holds its plateau, and flows far later
        unseen = EXACT * float(retardation.creep_compliance(curve.time[-1]) / curve.time[-1])
        retardation = replace(retardation, fluidity=unseen)
        warn(
            f"the curve shows no flow: the viscosity of {1 / unseen:.3g} Pa s, by which none is seen, is a guess: measure longer",
            mentions=("equilibrium_modulus",),
        )
    if solution.strength.any() or retardation.fluidity > 0:
        spectrum, equilibrium = relaxation_from_retardation(retardation)
    else:  # an elastic solid
        spectrum, equilibrium = Spectrum(process_time, np.zeros(process_time.size)), 1 / retardation.glassy_compliance
    if prescribed is not None:
        equilibrium = prescribed
    share = float(retardation.fluidity * curve.time[-1] / curve.values[0, -1])
    if is_open:
        warn(
            "the end of the curve does not distinguish flow from processes slower than the curve: it is taken for that of a solid, "
            f"whose equilibrium modulus of {3 * equilibrium:.3g} Pa (Young's) is a guess: state equilibrium_modulus (0 for a melt)",
            mentions=("equilibrium_modulus",),
        )
    elif prescribed is None and equilibrium == 0 and softest.slope >= -LEVEL_SLOPE:
        warn(
            f"the material flows, but flow is only {share:.1%} of its compliance at the end of the curve: a solid of "
            "far slower processes would look alike: state equilibrium_modulus (0 for a melt)",
            mentions=("equilibrium_modulus",),
        )
    elif prescribed is not None or equilibrium > 0 or softest.slope >= FLOWS:
        task.warn_of_equilibrium(equilibrium)

    truncated = task.keep is not None and task.keep < len(spectrum)
    if truncated:
        spectrum = spectrum.slowest(task.keep or 1)
    kept = retardation_from_relaxation(spectrum, equilibrium) if truncated else retardation
    model = kept.creep_compliance(curve.time)[None]
    return task.finish("nnls", spectrum, equilibrium, model, truncated, smoothing=solution.smoothing, retardation=kept)


def _what_to_fit(task: FitTask, flows: bool | None) -> tuple[Floats, Known, Total | None, bool]:
    """Retardation times (s, slowest first), the known constants, a prescribed sum, whether the curve leaves flow open."""
    curve, equilibrium = task.curve, task.equilibrium
    glassy_compliance = None if task.glassy is None else 1 / task.glassy
    fluid, solid = (glassy_compliance, None), (glassy_compliance, 0.0)
    if equilibrium is not None and equilibrium > 0:  # the compliances of a solid add up to that after infinite time
        return task.place(solid), solid, Total(1 / equilibrium, (1.0, 0.0)), False
    process_time = task.place(fluid)
    if equilibrium == 0 or flows:
        return process_time, fluid, None, False
    if flows is False or not _demands_flow(curve, process_time, glassy_compliance):
        return process_time, solid, None, False
    if task.times[1] is None:
        slower = task.place(solid, longest=SLOWER * float(curve.time[-1]))
        if not _demands_flow(curve, slower, glassy_compliance):
            return slower, solid, None, True
    return process_time, fluid, None, False


def _demands_flow(curve: WeightedCurve, process_time: Floats, glassy_compliance: float | None) -> bool:
    """Whether a fluidity, in addition to processes at these times (s), improves the fit significantly."""
    from scipy.special import stdtr

    fluid = fit_strengths(curve, process_time, (glassy_compliance, None), even=EVEN)
    if fluid.constants[1] == 0:
        return False
    solid = fit_strengths(curve, process_time, (glassy_compliance, 0.0), smoothing=fluid.smoothing)
    freedom = max(fluid.freedom, 1e-6)
    variance = max(fluid.misfit / freedom, EXACT**2)
    improvement = max(solid.objective - fluid.objective, 0.0)
    return float(stdtr(freedom, -np.sqrt(improvement / variance))) < LEAST_CHANCE


def _with_glassy(curve: WeightedCurve, process_time: Floats, known: Known, total: Total | None) -> Solution:
    """The strengths; if the curve does not show the glassy compliance, it is prescribed, with a warning."""
    solution = fit_strengths(curve, process_time, known, total)
    least = LEAST_GLASSY * float(curve.size[0])
    if known[0] is None and solution.constants[0] < least:
        warn(
            f"the curve does not show the glassy compliance, taken to be {LEAST_GLASSY:.0%} of its first point: the branches that "
            f"relax before {curve.time[0]:.3g} s are a guess; state glassy_modulus",
            mentions=("glassy_modulus",),
        )
        solution = fit_strengths(curve, process_time, (least, known[1]), total)
    return solution
