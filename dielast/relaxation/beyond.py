"""How relaxation may go on after the last point of a curve, and the equilibrium modulus that it leads to.

No curve tells a constant from a process that is far slower than the curve is long: without an assumption, the equilibrium modulus
is anything between 0 and the modulus at the end of every curve, levelled or not. The assumption here is that the spectrum H(ln tau)
goes on as it has begun. ln H is a random path over ln tau, from two decades before the end to four decades after it. Its slope
begins anywhere between a steep rise and a steep fall, and changes at random, mostly downwards, by small steps (a power law goes on)
or large ones (it is cut off). The size of H at the end and the equilibrium modulus are unknown in scale: their logarithms are
equally likely to have any value down to a small fraction of the modulus at the end (Jeffreys' prior of a scale, H. Jeffreys, Theory
of probability, 3rd ed., Oxford 1961, sec. 3.1). An end that does not fall at all is as likely as one that does. All this is
weighted by how likely it makes the end of the curve, with noise of unknown size. So the last slope and its change decide how far
the modulus may still fall, and a level end excludes a fall. A process that a plateau separates from the curve is not allowed for:
nothing shows it.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Self

import numpy as np

from dielast.errors import warn
from dielast.material.measurement_kind import RELAXATION
from dielast.material.scatter import interval
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Floats
from dielast.numerics.random_streams import stream
from dielast.relaxation.ends import long_time_end
from dielast.relaxation.nnls import WeightedCurve, non_negative
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.task import LEVEL_SLOPE

SEED = 1
LOOKED_AT = 1.3  # decades at the end of a curve that a path must describe
FASTER, SLOWER = 2.0, 4.0  # decades of relaxation times before and after the end of the curve
PER_DECADE, BRANCHES_PER_DECADE = 6, 3  # points of a path, and branches after the end
JOINED = 0.5  # decades before the end at which continuations begin
PATHS = 2**14
FIRST_SLOPE = (-0.3, 1.0)  # mean and standard deviation of d ln H/d ln tau where a path begins
FALLS, DROP = 0.3, (0.1, 10.0)  # falls of the slope per unit of ln tau, and the range of their mean size, gamma distributed
WANDERS = 0.2  # standard deviation of the change of the slope per square root of a unit of ln tau
LEAST_SIZE, LEAST_MODULUS = 1e-4, 0.3  # of the modulus at the end: below, H and the equilibrium modulus may as well be 0
ENOUGH = 200.0  # paths that must count; a curve more exact than the paths are dense is taken as less exact
GUIDES, GUIDED, LEAST_POWER = 2**11, 0.5, 0.01  # paths led to a curve, and by which power of the likelihood; the least such power
CHANGES, ROUNDS = (0.1, 0.2, 0.4), 3  # shares by which the steps of a path change at random, and how often
DRAWS, LEVEL = 400, 0.9
NEGLIGIBLE = 0.02  # of the modulus at the end: a plateau is reached if the modulus falls by no more, at the lower end of the range
MATCHED_PER_DECADE, RELUCTANCE, SMALL = 8, 1e-6, 0.01  # as in the draws of a spectrum
MEASURED = 10.0  # weight of the curve, which is measured, over what follows it


@dataclass(frozen=True, slots=True, eq=False)
class Continuations:
    """Draws of what follows a curve that ends at `end` (s): `equilibrium_modulus` (draws,) and `shear_modulus` (draws, k) in Pa of
    processes with the times `relaxation_time` (k,) in s, some of them within the curve. They hold at its end and after it.
    """

    end: float
    relaxation_time: Floats
    equilibrium_modulus: Floats
    shear_modulus: Floats

    def modulus(self, time: Floats) -> Floats:
        """Relaxation modulus (draws, n) in Pa at `time` (n,) in s."""
        return np.asarray(self.equilibrium_modulus[:, None] + self.shear_modulus @ np.exp(-time / self.relaxation_time[:, None]))

    def joined(self, spectrum: Spectrum, equilibrium: Floats, moduli: Floats) -> tuple[Floats, Floats, Floats]:
        """Relaxation times (k + N,), slower ones before those of the `spectrum`, and draws of the equilibrium modulus (draws,) and
        the moduli (draws, k + N) that relax as `equilibrium` (draws,) with `moduli` (draws, N) up to the end of the curve, and as
        the continuations after it.
        """
        tau = np.concatenate([self.end * 10 ** np.arange(SLOWER, 0.0, -1 / BRANCHES_PER_DECADE), spectrum.relaxation_time])
        first, last = min(tau[-1] / 2, self.end / 2), 2 * tau[0]
        time = np.geomspace(first, last, int(MATCHED_PER_DECADE * np.log10(last / first)) + 1)
        joint = self.end / 10**JOINED  # the fit alone levels off at its end, the continuations follow the curve
        curve, weight = time <= joint, np.where(time <= self.end, MEASURED, 1.0)
        measured = equilibrium[:, None] + moduli @ np.exp(-np.append(time[curve], joint) / spectrum.relaxation_time[:, None])
        scale = measured[:, -1:] / self.modulus(np.array([joint]))
        wanted = np.hstack([measured[:, :-1], scale * self.modulus(time[~curve])])
        level, decay = scale[:, 0] * self.equilibrium_modulus, np.exp(-time[:, None] / tau)
        slower = tau.size - moduli.shape[1]  # these begin with the moduli of the continuations, shared among neighbours in ln tau
        shares = [np.interp(np.log(self.relaxation_time), np.log(tau[::-1]), one) for one in np.eye(tau.size)[:slower, ::-1]]
        before = np.hstack([scale * self.shear_modulus @ np.transpose(shares), moduli])
        after = []
        for modulus, constant, old in zip(wanted, level, before, strict=True):
            # the smallest relative changes of the moduli that nearly suffice, as in the draws of a spectrum
            size = np.maximum(old, SMALL * np.interp(np.log(tau), np.log(time), modulus))
            held = np.sqrt(RELUCTANCE * time.size) * np.eye(tau.size)
            rows = np.vstack([decay * size * (weight / modulus)[:, None], held])
            after.append(size * non_negative(rows, np.concatenate([weight * (1 - constant / modulus), held @ (old / size)]))[0])
        return tau, level, np.array(after)


@dataclass(frozen=True, slots=True, eq=False)
class OpenEnd:
    """What the curve of a `fit` leaves open: the `range` of the equilibrium modulus in Pa (shear), a 90 % interval, None if it is
    known; whether the plateau was `reached`; and the `mean` of what may follow, None if nothing is open.
    """

    fit: SpectrumFit
    range: tuple[float, float] | None
    reached: bool
    mean: Continuations | None = None

    def carried_on(self) -> SpectrumFit:
        """The fit as it goes on after the curve by the mean: with slower branches, and a lower equilibrium modulus."""
        fit, own = self.fit, self.fit.spectrum
        if self.mean is None:
            return fit
        tau, level, moduli = self.mean.joined(own, np.array([fit.equilibrium_shear_modulus]), own.shear_modulus[None])
        return replace(fit, spectrum=Spectrum(tau, moduli[0]), equilibrium_shear_modulus=float(level[0]))


def end_of(fit: SpectrumFit, stated: bool = False) -> OpenEnd:
    """What the curve of a `fit` leaves open; `stated` says that the equilibrium modulus is known, as it is of a creeping fluid.

    Warns where the plateau was not reached, unless the curve falls so much that the fit has warned.
    """
    after = continuations(fit, np.ones((1, fit.reduced_time.size)), DRAWS)
    low, high = (float(bound) for bound in interval(after.equilibrium_modulus, LEVEL))
    ends_at = float(np.mean(after.modulus(np.array([after.end]))))
    high, reached = min(high, ends_at), low >= (1 - NEGLIGIBLE) * ends_at
    if reached or stated or (fit.retardation is not None and fit.retardation.fluidity > 0):
        return OpenEnd(fit, None, reached)
    stiffness = np.atleast_2d(fit.measured)[0] ** fit.kind.stiffness_power
    if -long_time_end(np.log10(fit.reduced_time), stiffness).slope <= LEVEL_SLOPE:
        warn(
            f"the curve ends before its plateau, at {3 * ends_at:.3g} Pa: the equilibrium modulus (Young's) is between "
            f"{3 * low:.3g} and {3 * high:.3g} Pa: state equilibrium_modulus if it is known",
            mentions=("equilibrium_modulus",),
        )
    means = (np.mean(each, axis=0)[None] for each in (after.equilibrium_modulus, after.shear_modulus))
    return OpenEnd(fit, (low, high), False, Continuations(after.end, after.relaxation_time, *means))


def continuations(fit: SpectrumFit, ratios: Floats, count: int) -> Continuations:
    """`count` draws of what may follow each of the curves that are `ratios` (curves, n) times the relaxation modulus at the reduced
    times of the `fit`.

    The relaxation modulus is that measured; of creep and oscillation, it is that of the fit, with the scatter of the measured
    stiffness.
    """
    time, kind = fit.reduced_time, fit.kind
    modulus = fit.spectrum.relaxation_modulus(time, fit.equilibrium_shear_modulus)
    off = np.atleast_2d(fit.measured)[0] / np.atleast_2d(fit.model)[0]
    near = np.log10(time) >= np.log10(time[-1]) - LOOKED_AT
    curve = WeightedCurve(
        time[near], (modulus * off**kind.stiffness_power)[None, near], np.ones(np.count_nonzero(near)), RELAXATION
    )
    end, generator = float(time[-1]), stream(SEED, "beyond the curve")
    guided = _guided(curve.averaged(), end, generator)
    cells = (replace(curve, values=curve.values * ratio[near]).averaged() for ratio in np.asarray(ratios))
    level, path = (
        np.concatenate(each) for each in zip(*(_draws(one, end, guided, count, generator) for one in cells), strict=True)
    )
    _, u, _ = _unguided()
    return Continuations(end, end * np.exp(u[::-1]), level, path[:, ::-1])


Steps = tuple[Floats, ...]  # of paths: first slope, mean fall, wandering and falls, each (paths, ...)


def _steps(count: int, generator: np.random.Generator) -> Steps:
    """Random steps of `count` paths, in standard form."""
    later = (count, round((FASTER + SLOWER) * PER_DECADE) - 1)
    first, drop = generator.standard_normal((count, 1)), generator.uniform(size=(count, 1))
    return first, drop, generator.standard_normal(later), generator.standard_gamma(FALLS * np.log(10) / PER_DECADE, later)


def _paths(steps: Steps) -> tuple[Floats, Floats]:
    """ln tau over the end of the curve (m,), and H times its spacing on each path (paths, m), 1 per unit of ln tau at the end."""
    first, drop, wander, fall = steps
    step, at_end = np.log(10) / PER_DECADE, round(FASTER * PER_DECADE)
    mean_fall = np.exp(np.log(DROP[0]) + drop * np.log(DROP[1] / DROP[0]))
    change = WANDERS * np.sqrt(step) * wander - mean_fall * fall
    slope = np.cumsum(np.hstack([FIRST_SLOPE[0] + FIRST_SLOPE[1] * first, change]), axis=1)
    height = np.hstack([np.zeros_like(first), np.cumsum(slope * step, axis=1)])
    height -= height[:, [at_end]]
    return step * (np.arange(height.shape[1]) - at_end), step * np.exp(np.clip(height, -60.0, 40.0))


@cache
def _unguided() -> tuple[Steps, Floats, Floats]:
    """The steps of paths that no curve has guided, and what `_paths` makes of them."""
    steps = _steps(PATHS, stream(SEED, "spectra beyond the curve"))
    return steps, *_paths(steps)


@dataclass(frozen=True, slots=True, eq=False)
class _Following:
    """How well paths follow the end of a curve: for each path, the normal likelihood of size and equilibrium modulus, cut off at 0.

    Means in terms of the modulus at the end; `square` is the sum of squares at the means and `allowed` that where neither is below
    0; a, b, c, d, e are the sums of the normal equations and n that of the weights.
    """

    mean_level: Floats
    mean_size: Floats
    square: Floats
    allowed: Floats
    a: float
    b: Floats
    c: Floats
    d: float
    det: Floats
    n: float

    @classmethod
    def of(cls, cells: WeightedCurve, end: float, u: Floats, paths: Floats) -> Self:
        # the average of k points is k times as certain; how certain that is, their scatter about the paths decides, cell by cell
        time, values, weight = cells.time, cells.values[0], cells.weight / cells.weight.mean()
        level, falling = values[-1] / values, (paths @ np.exp(-np.exp(np.log(time / end)[:, None] - u)).T) * values[-1] / values
        a, b, c = float(weight @ level**2), falling @ (weight * level), falling**2 @ weight
        d, e, n = float(weight @ level), falling @ weight, float(weight.sum())
        c = np.maximum(c, 1e-300)
        det = a * c * np.maximum(1 - b**2 / (a * c), 1e-12)
        mean_level, mean_size = (c * d - b * e) / det, (a * e - b * d) / det
        square = n - mean_level * d - mean_size * e
        bounded = np.minimum(n - np.maximum(e, 0) ** 2 / c, n - d**2 / a)
        allowed = np.where((mean_level >= 0) & (mean_size >= 0), square, bounded)
        return cls(mean_level, mean_size, square, allowed, a, b, c, d, det, n)

    @property
    def freedom(self) -> float:
        return max(self.n - 3, 1.0)

    @property
    def least(self) -> float:
        return max(float(self.allowed.min()), 1e-12)

    def spread(self, least: float) -> tuple[Floats, Floats]:
        """Standard deviations of equilibrium modulus and size where the least sum of squares is all noise."""
        noise = np.sqrt(least / self.freedom)
        return noise * np.sqrt(self.c / self.det), noise * np.sqrt(self.a / self.det)

    def evidence(self, least: float, power: float = 1.0) -> Floats:
        """ln of the likelihood to a `power`, integrated over size and equilibrium modulus, up to a constant, and over the noise."""
        from scipy.special import log_ndtr

        sigma_level, sigma_size = self.spread(least)
        inside = log_ndtr(self.mean_level / sigma_level) + log_ndtr(self.mean_size / sigma_size) - 0.5 * np.log(self.det)
        return np.asarray(inside - power * 0.5 * self.freedom * np.log(np.maximum(self.square, least) / least))


def _effective(logarithm: Floats) -> float:
    """Number of paths that count where these are the logarithms of their weights."""
    share = np.exp(logarithm - np.max(logarithm))
    return float(share.sum() ** 2 / (share @ share))


def _guided(cells: WeightedCurve, end: float, generator: np.random.Generator) -> tuple[Floats, Floats]:
    """Paths (paths, m) and the logarithms (paths,) of the weights that make them paths that no curve has guided.

    Where few of those follow the curve, they are led to it by sequential Monte Carlo (P. Del Moral, A. Doucet, A. Jasra, J. R.
    Stat. Soc. B 68 (2006) 411): the likelihood comes in by and by, and paths move by random changes of their steps that leave their
    distribution as it is (preconditioned Crank-Nicolson, S. L. Cotter et al., Stat. Sci. 28 (2013) 424).
    """
    steps, u, paths = _unguided()
    follow = _Following.of(cells, end, u, paths)
    least, power = follow.least, 0.0
    if _effective(follow.evidence(least, GUIDED)) >= ENOUGH:
        return paths, np.zeros(len(paths))
    target, constant = np.zeros(len(paths)), 0.0
    while power < GUIDED:
        least, before = min(least, follow.least), power
        power = GUIDED
        while power - before > LEAST_POWER and _effective(follow.evidence(least, power) - target) < min(len(target), GUIDES) / 4:
            power = before + (power - before) / 1.5
        gain = follow.evidence(least, power) - target
        share = np.exp(gain - gain.max())
        constant += float(gain.max() + np.log(share.mean()))
        kept = generator.choice(share.size, size=GUIDES, p=share / share.sum())
        steps = tuple(each[kept] for each in steps)
        follow = _Following.of(cells, end, u, _paths(steps)[1])
        target = follow.evidence(least, power)
        for change in np.tile(CHANGES, ROUNDS):
            fresh, old = _steps(GUIDES, generator), np.sqrt(1 - change**2)
            other = [generator.random(each.shape) < change / 2 for each in steps]
            trial = (
                old * steps[0] + change * fresh[0],
                np.where(other[1], fresh[1], steps[1]),
                old * steps[2] + change * fresh[2],
                np.where(other[3], fresh[3], steps[3]),
            )
            moved = _Following.of(cells, end, u, _paths(trial)[1])
            reached = moved.evidence(least, power)
            accepted = np.log(generator.random(GUIDES)) < reached - target
            target = np.where(accepted, reached, target)
            steps = tuple(np.where(accepted[:, None], new, each) for new, each in zip(trial, steps, strict=True))
        paths = _paths(steps)[1]
        follow = _Following.of(cells, end, u, paths)
    return paths, constant - target


def _draws(
    cells: WeightedCurve, end: float, guided: tuple[Floats, Floats], count: int, generator: np.random.Generator
) -> tuple[Floats, Floats]:
    """Equilibrium moduli (count,) and moduli along paths (count, m) that go with the curve of `cells`."""
    from scipy.special import ndtr, ndtri

    u, (paths, unguided), scale = _unguided()[1], guided, cells.values[0, -1]
    follow = _Following.of(cells, end, u, paths)
    least = follow.least
    (sigma_level, sigma_size), rho = follow.spread(least), -follow.b / np.sqrt(follow.a * follow.c)
    mean_level, mean_size, power = follow.mean_level, follow.mean_size, 1.0
    while True:
        weight = unguided + follow.evidence(least, power)
        if power < LEAST_POWER or _effective(weight) >= ENOUGH:
            break
        power *= 0.8
    many, share = 10 * count + 200, np.exp(weight - weight.max())
    share /= share.sum()
    k = generator.choice(share.size, size=many, p=share)
    first, second = generator.random((2, many))

    def positive(mean: Floats, sigma: Floats, chance: Floats) -> Floats:
        below = ndtr(-mean / sigma)
        return np.maximum(mean + sigma * ndtri(np.clip(below + (1 - below) * chance, 1e-15, 1 - 1e-15)), 0.0)

    size = positive(mean_size[k], sigma_size[k], first)
    given = mean_level[k] + rho[k] * sigma_level[k] / sigma_size[k] * (size - mean_size[k])
    level = positive(given, sigma_level[k] * np.sqrt(1 - rho[k] ** 2), second)
    likely = 1 / ((size + LEAST_SIZE) * (level + LEAST_MODULUS))
    chosen = generator.choice(many, size=count, p=likely / likely.sum())
    # the evidence for a curve that falls by no path, and for one that falls, by the curve as measured
    noise, drops = np.sqrt(least / follow.freedom), float(np.mean(1 / (size + LEAST_SIZE))) / -np.log(LEAST_SIZE)
    falls = float(np.mean(np.exp(unguided + follow.evidence(least)))) * 2 * np.pi * noise**2 * drops
    a, square = follow.a, follow.n - follow.d**2 / follow.a
    stays = (max(square, least) / least) ** (-0.5 * follow.freedom) * np.sqrt(2 * np.pi / a) * noise
    level, size = level[chosen], size[chosen]
    constant = generator.random(count) < stays / (stays + falls)
    level[constant] = np.maximum(follow.d / a + noise / np.sqrt(a) * generator.standard_normal(int(constant.sum())), 0.0)
    size[constant] = 0.0
    return level * scale, size[:, None] * paths[k[chosen]] * scale
