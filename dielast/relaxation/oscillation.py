"""From a frequency sweep, shifted to one temperature, to the discrete relaxation spectrum."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.spectrum import Spectrum
from dielast.relaxation.checks import (
    Ends,
    check_counts,
    check_ends,
    check_moduli,
    judge_equilibrium,
    judge_fit,
    of_liquid,
    share_kept,
    sorted_points,
)
from dielast.relaxation.ends import extremes, long_time_end, votes
from dielast.relaxation.fit import SpectrumFit, placed_times
from dielast.relaxation.nnls import Curve, Total, fit_strengths
from dielast.relaxation.response import OSCILLATION

_PAST = 10**0.5  # a process shows in the loss modulus beyond the frequencies measured: half a decade on either side belongs to it


def fit_oscillation(
    reduced_angular_frequency: ArrayLike,
    storage_modulus: ArrayLike,
    loss_modulus: ArrayLike,
    *,
    branches: int = 30,
    relaxation_time: Ends = (None, None),
    equilibrium_modulus: float | None = None,
    glassy_modulus: float | None = None,
    keep: int | None = None,
    liquid: bool = False,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve of storage and loss modulus (Young's, Pa) over angular frequency (rad/s).

    All of shape (n,), in any order. Non-negative moduli are fitted to the relative errors of both moduli together, as smooth as the
    data ask for; relaxation times, prescribed moduli (Young's, Pa), `keep` and `liquid` are those of `fit_spectrum`.
    `equilibrium_modulus` is by default fitted, too.

    Raises `InputError` for points or arguments that allow no fit; warns as `fit_spectrum` does, the storage modulus at the lowest
    frequencies being what has levelled off or not.
    """
    frequency, storage, loss = sorted_points(
        ("reduced angular frequency", "rad/s", reduced_angular_frequency),
        ("storage modulus", "Pa", storage_modulus),
        ("loss modulus", "Pa", loss_modulus),
    )
    equilibrium_modulus = of_liquid(liquid, equilibrium_modulus)
    check_counts("nnls", branches, 1, keep)
    check_ends(relaxation_time)
    time, measured = 1 / frequency[::-1], np.stack([storage, loss])[:, ::-1]
    curve = Curve(time, measured / 3, votes(np.log10(time)), OSCILLATION)
    plateau = long_time_end(np.log10(time), curve.values[0])
    check_moduli(equilibrium_modulus, glassy_modulus, *extremes(np.log10(time), 3 * curve.values[0]))
    known = None if equilibrium_modulus is None else equilibrium_modulus / 3
    tau = placed_times(curve, branches, relaxation_time, (known,), _PAST, share_kept(branches, keep))
    solution = fit_strengths(curve, tau, (known,), None if glassy_modulus is None else Total(glassy_modulus / 3, (1.0,)))
    equilibrium = float(solution.constants[0])
    if not liquid:
        judge_equilibrium(known, equilibrium, plateau)

    spectrum = Spectrum(tau[:keep], solution.strength[:keep])
    model = np.stack([spectrum.storage_modulus(1 / time, equilibrium), spectrum.loss_modulus(1 / time)])
    truncated = keep is not None and keep < branches
    mean, worst = judge_fit(model / curve.values - 1, time, float(tau[:keep][-1]) if truncated else None)
    return SpectrumFit(
        method="nnls",
        spectrum=spectrum,
        equilibrium_shear_modulus=equilibrium,
        rms_relative_error=mean,
        max_relative_error=worst,
        reduced_time=time,
        measured=measured,
        model=3 * model,
        smoothing=solution.smoothing,
        test="oscillation",
    )
