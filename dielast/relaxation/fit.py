"""From a master curve of relaxation or oscillation to the discrete relaxation spectrum of a generalised Maxwell solid."""

from typing import get_args

from numpy.typing import ArrayLike

from dielast.base.errors import InputError, shown
from dielast.material.measurement_kind import OSCILLATION, RELAXATION
from dielast.relaxation.checks import Plateaus, TimeRange
from dielast.relaxation.result import Method, SpectrumFit
from dielast.relaxation.schwarzl_staverman import FEWEST_BRANCHES, schwarzl_staverman
from dielast.relaxation.task import FitTask

PAST_ENDS = 10**0.5  # a process affects the loss modulus within half a decade on either side of its frequency


def fit_spectrum(
    reduced_time: ArrayLike,
    modulus: ArrayLike,
    *,
    method: Method = "nnls",
    branches: int | None = None,
    polynomial_degree: int = 7,
    relaxation_time: TimeRange = (None, None),
    plateaus: Plateaus = Plateaus(),
    keep: int | None = None,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve: `modulus` (Young's, Pa) over `reduced_time` (s), both (n,), in any order.

    "nnls" fits non-negative moduli to the relative error. "schwarzl-staverman" (Eqs. 14-20 of DOI 10.1115/1.4030850) derives the
    spectrum from a polynomial through log G over log t of `polynomial_degree`, and has the error of that polynomial and of the
    approximation. The material is incompressible: shear modulus = Young's / 3. Points that are dense in log time share their
    weight.

    There are by default 30 `branches`, or 5 a decade of the curve if these are more, the method is nnls, and `keep` is not stated;
    an end of `relaxation_time`, the shortest and the longest time in s, counts in place of that of the curve. If one is None,
    schwarzl-staverman uses the range in which t = 2 tau stays on the curve, and nnls places it inside the curve where it fits best.
    The equilibrium modulus of the `plateaus` is by default that at the end of the curve, or fitted by nnls. Their glassy modulus is
    three times the sum of all shear moduli including the equilibrium modulus, which determines mu_neq of Eq. 20. By default,
    schwarzl-staverman uses the largest modulus of the curve, smoothed, or the equilibrium modulus plus H at the shortest relaxation
    time if that is larger; nnls does not prescribe it. `keep` truncates to the slowest branches (Sec. 3.4).

    Raises `InputError` for points or arguments that allow no fit, and if negative moduli contribute more than 2 % of G(t). Warns of
    smaller negative moduli (they are set to 0), of extrapolation, of an end without a plateau, of a plateau far above the stated
    equilibrium modulus, and of a poor fit.
    """
    if method not in get_args(Method):
        raise InputError(f'{shown(method)}: "schwarzl-staverman" or "nnls" is needed', argument="method")
    by_polynomial = method != "nnls"
    degree = int(polynomial_degree) if by_polynomial else 0
    if by_polynomial and degree < 1:
        raise InputError(f"{degree}: at least 1 is needed", argument="polynomial_degree")
    columns, fewest = (reduced_time, modulus), FEWEST_BRANCHES if by_polynomial else 1
    task = FitTask(RELAXATION, columns, branches, relaxation_time, plateaus, keep, method, fewest)
    return schwarzl_staverman(task, degree) if by_polynomial else task.fit_moduli(past=1.0)


def fit_oscillation(
    reduced_angular_frequency: ArrayLike,
    storage_modulus: ArrayLike,
    loss_modulus: ArrayLike,
    *,
    branches: int | None = None,
    relaxation_time: TimeRange = (None, None),
    plateaus: Plateaus = Plateaus(),
    keep: int | None = None,
) -> SpectrumFit:
    """Discrete relaxation spectrum of a master curve of storage and loss modulus (Young's, Pa) over angular frequency (rad/s).

    All are of shape (n,), in any order. Non-negative moduli are fitted to the relative errors of both moduli together, with the
    smoothness that the data support (`dielast.relaxation.nnls`); the other arguments are as in `fit_spectrum`. The equilibrium
    modulus is fitted by default.

    Raises `InputError` for points or arguments that allow no fit; warns as `fit_spectrum` does, with the storage modulus at the
    lowest frequencies as the end of the curve.
    """
    columns = (reduced_angular_frequency, storage_modulus, loss_modulus)
    task = FitTask(OSCILLATION, columns, branches, relaxation_time, plateaus, keep)
    return task.fit_moduli(PAST_ENDS)
