"""From a creep compliance, shifted to one temperature, to the discrete relaxation spectrum, by way of the retardation spectrum."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.characterise.curve import End, least_modulus, long_time_end, votes
from dielast.characterise.interconversion import RetardationSpectrum, relaxation_from_retardation, retardation_from_relaxation
from dielast.characterise.judge import Ends, check_counts, check_ends, check_moduli, judge_equilibrium, judge_fit, sorted_points
from dielast.characterise.nnls import Curve, Known, Solution, Total, fit_strengths
from dielast.characterise.response import CREEP
from dielast.characterise.spectrum import SpectrumFit, placed_times
from dielast.errors import InputError, warn
from dielast.prony import Spectrum

Array = NDArray[np.float64]

_LEAST_GLASSY = 0.01  # of the first compliance: a glassy compliance found smaller than this is not to be told from none
_FLOWS = -0.8  # d log(1/J)/d log t: a compliance that rises as steeply is that of a melt, and needs no word


def fit_creep(
    reduced_time: ArrayLike,
    creep_compliance: ArrayLike,
    *,
    branches: int = 30,
    retardation_time: Ends = (None, None),
    equilibrium_modulus: float | None = None,
    glassy_modulus: float | None = None,
    keep: int | None = None,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve of tensile creep compliance (1/Pa) over `reduced_time` (s), (n,) in any order.

    `branches` retardation processes, a glassy compliance and a fluidity, none negative, are fitted to the relative error, as smooth
    as the data ask for, and converted exactly (`relaxation_from_retardation`); processes of no strength drop out, and a material
    that flows has one branch more. `retardation_time` holds the shortest and the longest in s, chosen as in `fit_spectrum` where
    left out. `equilibrium_modulus` (Young's, Pa) is that after infinite time, 0 for a melt, and fitted by default;
    `glassy_modulus`, the sum of all moduli less the equilibrium one, is only taken together with it. `keep` truncates to the
    slowest branches.

    Raises `InputError` for points or arguments that allow no fit; warns as `fit_spectrum` does, and where the curve does not tell
    the glassy compliance: the fastest branch is then a guess.
    """
    time, measured = sorted_points(("reduced time", "s", reduced_time), ("creep compliance", "1/Pa", creep_compliance))
    check_counts("nnls", branches, 1, keep)
    check_ends(retardation_time)
    curve = Curve(time, 3 * measured[None], votes(np.log10(time)), CREEP)
    softest = long_time_end(np.log10(time), 1 / curve.size)
    check_moduli(equilibrium_modulus, glassy_modulus, 3 * least_modulus(np.log10(time), 1 / curve.size))
    solution, own_time = _fit(curve, branches, retardation_time, equilibrium_modulus, glassy_modulus)
    retardation = RetardationSpectrum(own_time, solution.strength, *solution.constants.tolist())
    if solution.strength.any() or retardation.fluidity > 0:
        spectrum, equilibrium = relaxation_from_retardation(retardation)
    else:  # an elastic solid
        spectrum, equilibrium = Spectrum(own_time, np.zeros(own_time.size)), 1 / retardation.glassy_compliance
    if equilibrium_modulus is not None:
        equilibrium = equilibrium_modulus / 3
    _judge_long_times(equilibrium_modulus, equilibrium, softest)

    truncated = keep is not None and keep < len(spectrum)
    if truncated:
        spectrum = spectrum.slowest(keep or 1)
    kept = retardation_from_relaxation(spectrum, equilibrium) if truncated else retardation
    model = kept.creep_compliance(time)
    shortest = float(spectrum.relaxation_time[-1]) if truncated else None
    mean, worst = judge_fit(model / curve.values - 1, time, shortest)
    return SpectrumFit(
        method="nnls",
        spectrum=spectrum,
        equilibrium_shear_modulus=equilibrium,
        branches=len(spectrum),
        clipped_branches=0,
        rms_relative_error=mean,
        max_relative_error=worst,
        reduced_time=time,
        measured=measured,
        model=model / 3,
        smoothing=solution.smoothing,
        test="creep",
        retardation=kept,
    )


def _fit(curve: Curve, branches: int, wanted: Ends, equilibrium: float | None, glassy: float | None) -> tuple[Solution, Array]:
    """Retardation spectrum and its times (s), slowest first; moduli are Young's, Pa."""
    if glassy is not None and equilibrium is None:
        raise InputError(
            "glassy_modulus needs equilibrium_modulus beside it in creep: it is what the modulus falls by (0 for a melt)"
        )
    glassy_compliance = None if glassy is None or equilibrium is None else 3 / (glassy + equilibrium)
    solid = equilibrium is not None and equilibrium > 0
    known: Known = (glassy_compliance, 0.0 if solid else None)
    # a solid's compliances add up to the one after infinite time
    total = Total(3 / equilibrium, (1.0, 0.0)) if solid and equilibrium is not None else None
    own_time = placed_times(curve, branches, wanted, known)
    solution = fit_strengths(curve, own_time, known, total)
    least = _LEAST_GLASSY * float(curve.size[0])
    if glassy_compliance is None and solution.constants[0] < least:
        warn(
            f"the curve does not tell the glassy compliance, taken to be {_LEAST_GLASSY:.0%} of its first point: the branches that "
            f"relax before {curve.time[0]:.3g} s are a guess; state glassy_modulus"
        )
        solution = fit_strengths(curve, own_time, (least, known[1]), total)
    return solution, own_time


def _judge_long_times(known: float | None, equilibrium: float, softest: End) -> None:
    if known is None and equilibrium == 0 and softest.slope < _FLOWS:
        return
    judge_equilibrium(None if known is None else known / 3, equilibrium, softest)
