"""How likely the equilibrium moduli about that of a fit are, by the curve alone.

No modulus of a spectrum is negative. Where the slowest branches of the truth are next to nothing, noise in one sense is taken for
slow relaxation, which lowers the equilibrium modulus of the fit, and noise in the other for nothing. Fits to noisy copies of the
curve are lowered once more, so that their equilibrium moduli scatter about a wrong value. The likelihood of an equilibrium modulus,
with all moduli that go with it at their best (the profile likelihood; O. E. Barndorff-Nielsen, D. R. Cox, Inference and
asymptotics, London 1994), does not: a lower one costs little where slow branches make up for it, and a higher one as much
as it misses the curve. It asks for no smoothness, which would be a bias where a spectrum ends.

The square root of the rise of -2 ln of this likelihood, with the sign of the deviation, would be standard normal but for the moduli
that are 0. How it scatters is therefore seen in resampled curves, of the best spectrum with each of some equilibrium moduli and of
noise as large as that of the curve (hybrid resampling: C.-S. Chuang, T. L. Lai, Statistica Sinica 10 (2000) 1).
"""

from collections.abc import Callable

import numpy as np

from dielast.numerics.arrays import Floats
from dielast.numerics.random_streams import stream
from dielast.relaxation.nnls import EXACT, WeightedCurve, non_negative, reduced_rows, relative_rows
from dielast.relaxation.result import SpectrumFit

SEED = 1  # equal curves give equal levels
FIRST_STEP, STEPS = 1e-4, 40  # of ln of the modulus; steps on either side
EVERY = 20  # of these steps, one at which curves are resampled
UNLIKELY = 12.0  # -2 ln of a relative likelihood at which the search ends: about 0.05 % lie beyond
WIDEST = 0.5  # of ln of the modulus: a plateau that was reached is known far better


def likely_levels(fit: SpectrumFit, chance: Floats) -> Floats:
    """The ratio (n,) of an equilibrium modulus to that of the `fit` below which the truth is with each `chance` (n,), from 0 to 1.

    All points count alike, as noise of equal relative size that is independent from point to point.
    """
    from scipy.special import ndtri

    time, kind = fit.reduced_time, fit.kind
    values = np.atleast_2d(fit.measured) * 3.0**-kind.stiffness_power
    curve = WeightedCurve(time, values, np.ones(time.size), kind)
    tau, level = fit.spectrum.relaxation_time, fit.equilibrium_shear_modulus
    scale = np.exp(np.interp(np.log(tau), np.log(time), np.log(curve.size)))
    design, target = relative_rows(curve, tau, scale, (None,))
    rows, wanted = reduced_rows(design, target, curve.row_weight)
    best, least = non_negative(rows, wanted)
    constant, size = rows[:, -1], curve.constant_scale[0]
    variance = least**2 / max(target.size - int(np.count_nonzero(best)), 1)
    if best[-1] <= 0 or least <= EXACT * np.sqrt(target.size):
        return np.ones_like(chance)

    def held(logarithm: float, values: Floats) -> tuple[Floats, float]:
        return non_negative(rows[:, :-1], values - constant * (level / size * np.exp(logarithm)))

    def rise(logarithm: float) -> float:
        return (held(logarithm, wanted)[1] ** 2 - least**2) / variance

    def resampled(logarithm: float) -> tuple[float, float]:
        """Mean and standard deviation of the signed root, were this the truth."""
        there = level / size * np.exp(logarithm)
        curves = rows[:, :-1] @ held(logarithm, wanted)[0] + constant * there + noise
        fits = [(*non_negative(rows, values), held(logarithm, values)[1]) for values in curves]
        roots = [np.sign(there - fit[-1]) * np.sqrt(max(alone**2 - free**2, 0.0) / variance) for fit, free, alone in fits]
        return float(np.mean(roots)), float(np.std(roots))

    axes = np.linalg.qr(stream(SEED, "levels").standard_normal((wanted.size, wanted.size)))[0]
    noise = np.sqrt(variance * wanted.size) * np.concatenate([axes, -axes])  # its covariance is exact
    middle = float(np.log(best[-1] * size / level))
    below, above = (np.linspace(0.0, side * _far(rise, middle, side), STEPS + 1) for side in (-1.0, 1.0))
    place = middle + np.concatenate([below[::-1], above[1:]])
    root = np.sign(place - middle) * np.sqrt([max(rise(each), 0.0) for each in place.tolist()])
    mean, spread = np.array([resampled(each) for each in place[::EVERY].tolist()]).T
    mean, spread = (np.interp(place, place[::EVERY], each) for each in (mean, spread))
    normal = np.divide(root - mean, spread, out=np.zeros(place.size), where=spread > 0)
    return np.asarray(np.exp(np.interp(ndtri(chance), np.maximum.accumulate(normal), place)))


def _far(rise: Callable[[float], float], middle: float, side: float) -> float:
    """The distance from the `middle` to one `side` at which a `rise` reaches what is unlikely, within a fifth."""
    far = FIRST_STEP
    while far < WIDEST and rise(middle + side * far) < UNLIKELY:
        far *= 2
    near = far / 2
    while far > 1.2 * near:
        between = float(np.sqrt(near * far))
        near, far = (between, far) if rise(middle + side * between) < UNLIKELY else (near, between)
    return far
