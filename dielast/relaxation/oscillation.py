"""From a frequency sweep, shifted to one temperature, to the discrete relaxation spectrum."""

from __future__ import annotations

from numpy.typing import ArrayLike

from dielast.material.measurement_kind import OSCILLATION
from dielast.relaxation.checks import TimeRange
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.task import FitTask

PAST_ENDS = 10**0.5  # a process affects the loss modulus within half a decade on either side of its frequency


def fit_oscillation(
    reduced_angular_frequency: ArrayLike,
    storage_modulus: ArrayLike,
    loss_modulus: ArrayLike,
    *,
    branches: int = 30,
    relaxation_time: TimeRange = (None, None),
    equilibrium_modulus: float | None = None,
    glassy_modulus: float | None = None,
    keep: int | None = None,
    liquid: bool = False,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve of storage and loss modulus (Young's, Pa) over angular frequency (rad/s).

    All are of shape (n,), in any order. Non-negative moduli are fitted to the relative errors of both moduli together, with the
    smoothness that the data support (`dielast.relaxation.nnls`); relaxation times, prescribed moduli (Young's, Pa), `keep` and
    `liquid` are as in `fit_spectrum`. `equilibrium_modulus` is fitted by default.

    Raises `InputError` for points or arguments that allow no fit; warns as `fit_spectrum` does, with the storage modulus at the
    lowest frequencies as the end of the curve.
    """
    columns = (reduced_angular_frequency, storage_modulus, loss_modulus)
    task = FitTask.of(OSCILLATION, columns, branches, relaxation_time, equilibrium_modulus, glassy_modulus, keep, liquid)
    return task.fit_moduli(PAST_ENDS)
