"""The continuous relaxation spectrum H(ln tau) of a fitted curve.

G(t) = G_e + int H exp(-t/tau) d ln tau, and likewise for storage and loss modulus, with H >= 0 on a grid finer than the curve can
resolve. Many H fit the curve equally well; the one whose smoothness minimises the cross-validation score is used, by Tikhonov
regularisation of the second differences as in the discrete fit (see `dielast.relaxation.nnls`).
"""

from dataclasses import dataclass

import numpy as np

from dielast.base.errors import InputError, warn
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.numerics.arrays import Floats, rms
from dielast.relaxation.ends import votes
from dielast.relaxation.nnls import EVEN, WeightedCurve, fit_strengths
from dielast.relaxation.result import SpectrumFit

LEAST_SMOOTHING = 1e-2  # less splits H into lines if there is no noise, and no measurement is so accurate
MOST_PIECES = 4  # number of separate processes that a material may have
# Decades beyond either end of the curve with processes that are fitted but not part of the result. Processes far faster than the
# curve still contribute to a loss modulus, in proportion to their times; without a place of its own, this would go into H.
BEYOND = 3.0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ContinuousSpectrum(TabularResult):
    """`density` H (Pa, shear) per unit of ln tau at `relaxation_time` (s), both (n,), slowest first and evenly spaced in log time.

    Each value is the average over a cell of `width` (in ln tau) around its time. `rms_relative_error` is that of the curve from H.
    """

    relaxation_time: Floats
    density: Floats
    width: float
    smoothing: float
    rms_relative_error: float

    def columns(self) -> Table:
        """The table, one row per relaxation time."""
        return [Column("relaxation_time", "s", self.relaxation_time), Column("H", "Pa", self.density)]

    @property
    def integral(self) -> float:
        """int H d ln tau over the curve in Pa, the counterpart of the sum of the moduli of a discrete spectrum."""
        return float(self.density.sum() * self.width)


def continuous_spectrum(fit: SpectrumFit, points_per_decade: int = 10) -> ContinuousSpectrum:
    """H(ln tau) of the curve of a `fit`, with its equilibrium modulus, from its first to its last time, at `points_per_decade`.

    Faster and slower processes are fitted as well, but the curve tells little more of them than their sum. Warns if H splits into
    many pieces. Raises `InputError` for a creep curve, whose relaxation spectrum follows only from a discrete retardation spectrum.
    """
    if fit.retardation is not None:
        raise InputError("a creep curve has no continuous relaxation spectrum, only a discrete one")
    if points_per_decade < 1:
        raise InputError(f"{points_per_decade} points per decade: at least one is needed")
    time = fit.reduced_time
    beyond, inside = (int(points_per_decade * decades + 1e-6) for decades in (BEYOND, np.log10(time[-1] / time[0])))
    grid = time[-1] * 10 ** (np.arange(beyond, -beyond - inside - 1, -1) / points_per_decade)
    within = slice(beyond, beyond + inside + 1)
    kind = fit.kind
    curve = WeightedCurve(time, np.atleast_2d(fit.measured) / 3, votes(np.log10(time)), kind)
    solution = fit_strengths(curve, grid, (fit.equilibrium_shear_modulus,), least=LEAST_SMOOTHING, even=EVEN)
    model = kind.processes(time, grid) @ solution.strength + kind.constants(time)[0] * fit.equilibrium_shear_modulus
    strength = solution.strength[within]
    pieces = int(np.count_nonzero(np.diff((strength > 0).astype(int)) > 0)) + int(strength[0] > 0)
    if pieces > MOST_PIECES:
        warn(
            f"the continuous spectrum falls apart into {pieces} pieces: the curve's errors are alike from point to point, or it "
            "was made of a discrete spectrum; only the course of H on average means something"
        )
    width = float(np.log(10) / points_per_decade)
    return ContinuousSpectrum(grid[within], strength / width, width, solution.smoothing, rms(model / curve.values - 1))
