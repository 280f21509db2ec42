"""How relaxation may go on after the last point of a curve, and the equilibrium modulus that it leads to.

No curve tells a constant from a process that is far slower than the curve is long: without an assumption, the equilibrium modulus
is anything between 0 and the modulus at the end of every curve, levelled or not. The assumption here is that the spectrum H(ln tau)
goes on as it has begun. ln H is a random path over ln tau (see `paths`), from two decades before the end to four decades after it.
Its slope begins anywhere between a steep rise and a steep fall, and changes at random, mostly downwards, by small steps (a power
law goes on) or large ones (it is cut off); some spectra end with the curve. The size of H at the end and the equilibrium modulus
are unknown in scale: the logarithm of the size is equally likely to have any value down to a ten-thousandth of the modulus at the
end (Jeffreys' prior of a scale, H. Jeffreys, Theory of probability, 3rd ed., Oxford 1961, sec. 3.1). Of the equilibrium modulus
this holds down to about a third of the modulus at the end, and below, every value is equally likely. Both bounds are choices, and
so are the numbers of the paths. The stated range depends on them, as does how often it holds the truth. It is a range for materials
like those that the choices expect. An end that does not fall at all is as likely as one that does. All this is weighted by how
likely it makes the end of the curve, with noise of unknown size. So the last slope and its change decide how far the modulus may
still fall, and a level end excludes a fall. A process that a plateau separates from the curve is not allowed for: nothing shows it.
"""

from dataclasses import dataclass, replace

import numpy as np

from dielast.base.errors import InputError, warn
from dielast.material.intervals import interval
from dielast.material.measurement_kind import RELAXATION
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.random_streams import stream
from dielast.relaxation.ends import long_time_end
from dielast.relaxation.nnls import WeightedCurve, non_negative
from dielast.relaxation.paths import (
    BRANCHES_PER_DECADE,
    ENOUGH,
    LEAST_POWER,
    SEED,
    SLOWER,
    Following,
    effective,
    guided_paths,
    unguided_paths,
)
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.task import LEVEL_SLOPE

# Of the largest modulus near the end, about 3e-39. Likelihoods take the fourth power of the ratio of moduli, which leaves half of
# the range of exponents of numbers to the heights of paths.
LOST = float(np.finfo(float).tiny ** (1 / 8))
# Decades at the end of a curve that a path must describe, a choice: less has too few points, more has other processes.
LOOKED_AT = 1.3
JOINED = 0.5  # decades before the end at which continuations begin
# Choices, of the modulus at the end: where the prior of the size of H and of the equilibrium modulus changes from even in the
# logarithm to even in the value. A larger LEAST_MODULUS makes moduli far below the end of the curve less likely.
LEAST_SIZE, LEAST_MODULUS = 1e-4, 0.3
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
    if fit.retardation is not None and fit.retardation.fluidity > 0:  # falls to zero, maybe long before its creep curve ends
        return OpenEnd(fit, None, False)
    after = continuations(fit, np.ones((1, fit.reduced_time.size)), DRAWS)
    low, high = (float(bound) for bound in interval(after.equilibrium_modulus, LEVEL))
    ends_at = float(np.mean(after.modulus(np.array([after.end]))))
    high, reached = min(high, ends_at), low >= (1 - NEGLIGIBLE) * ends_at
    if reached or stated:
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
    measured, model = np.atleast_2d(fit.measured)[0], np.atleast_2d(fit.model)[0]
    # a fit that misses the curve may be zero where its slowest branch has relaxed
    shown = (modulus > 0) & (model > 0)
    off = np.divide(measured, model, out=np.ones_like(measured), where=shown)
    stiffness = np.where(shown, modulus * off**kind.stiffness_power, measured**kind.stiffness_power / 3)
    near = np.log10(time) >= np.log10(time[-1]) - LOOKED_AT
    if (ends := stiffness[near]).min() < LOST * ends.max():
        at = time[near][np.argmin(ends)]
        raise InputError(
            f"near its end the curve is at {3 * ends.min():.3g} and {3 * ends.max():.3g} Pa, the former at {at:.3g} s: leave it out"
        )
    curve = WeightedCurve(time[near], stiffness[None, near], np.ones(np.count_nonzero(near)), RELAXATION)
    end, generator = float(time[-1]), stream(SEED, "beyond the curve")
    guided = guided_paths(curve.averaged(), end, generator)
    cells = (replace(curve, values=curve.values * ratio[near]).averaged() for ratio in np.asarray(ratios))
    level, path = (
        np.concatenate(each) for each in zip(*(_draws(one, end, guided, count, generator) for one in cells), strict=True)
    )
    _, u, _ = unguided_paths()
    return Continuations(end, end * np.exp(u[::-1]), level, path[:, ::-1])


def _draws(
    cells: WeightedCurve, end: float, guided: tuple[Floats, Floats], count: int, generator: np.random.Generator
) -> tuple[Floats, Floats]:
    """Equilibrium moduli (count,) and moduli along paths (count, m) that go with the curve of `cells`."""
    paths, unguided = guided
    follow, scale = Following.of(cells, end, unguided_paths()[1], paths), cells.values[0, -1]
    many, share = 10 * count + 200, _chances_of_paths(follow, unguided)
    k = generator.choice(share.size, size=many, p=share)
    size, level, allowed = _sizes_and_levels(follow, k, *generator.random((2, many)))
    drop = np.exp(allowed) / (size + LEAST_SIZE)
    likely = np.exp(allowed - allowed.max()) / ((size + LEAST_SIZE) * (level + LEAST_MODULUS))  # all of `drop` may be 0
    chosen = generator.choice(many, size=count, p=likely / likely.sum())
    level, size, noise = level[chosen], size[chosen], np.sqrt(follow.least / follow.freedom)
    constant = generator.random(count) < _chance_of_no_fall(follow, unguided, noise, float(np.mean(drop)))
    level[constant] = np.maximum(
        follow.d / follow.a + noise / np.sqrt(follow.a) * generator.standard_normal(int(constant.sum())), 0.0
    )
    size[constant] = 0.0
    return level * scale, size[:, None] * paths[k[chosen]] * scale


def _chances_of_paths(follow: Following, unguided: Floats) -> Floats:
    """The chances (paths,) by which paths are drawn: those of the evidence, weakened until enough paths count."""
    power = 1.0
    while True:
        weight = unguided + follow.evidence(follow.least, power)
        if power < LEAST_POWER or effective(weight) >= ENOUGH:
            share = np.exp(weight - weight.max())
            return np.asarray(share / share.sum())
        power *= 0.8


def _sizes_and_levels(follow: Following, k: Cases, first: Floats, second: Floats) -> tuple[Floats, Floats, Floats]:
    """Sizes and levels (many,) of the paths `k` (many,), both positive, at the chances `first` and `second` (many,); and of a path
    and a size, the log of the chance of a level above 0, in place of that for all sizes, which is in the evidence.
    """
    from scipy.special import log_ndtr, ndtr, ndtri

    (sigma_level, sigma_size), rho = follow.spread(follow.least), -follow.b / np.sqrt(follow.a * follow.c)

    def positive(mean: Floats, sigma: Floats, chance: Floats) -> Floats:
        below = ndtr(-mean / sigma)
        return np.maximum(mean + sigma * ndtri(np.clip(below + (1 - below) * chance, 1e-15, 1 - 1e-15)), 0.0)

    size = positive(follow.mean_size[k], sigma_size[k], first)
    given = follow.mean_level[k] + rho[k] * sigma_level[k] / sigma_size[k] * (size - follow.mean_size[k])
    given_size = sigma_level[k] * np.sqrt(np.maximum(1 - rho[k] ** 2, 1e-12))  # as in `det`
    allowed = log_ndtr(given / given_size) - log_ndtr(follow.mean_level[k] / sigma_level[k])
    return size, positive(given, given_size, second), allowed


def _chance_of_no_fall(follow: Following, unguided: Floats, noise: float, drop: float) -> float:
    """The chance that a curve falls by no path, by the evidence for that and for a curve that falls, of the curve as measured."""
    fallen = float(np.mean(np.exp(unguided + follow.evidence(follow.least))))
    falls = fallen * 2 * np.pi * noise**2 * (drop / -np.log(LEAST_SIZE))
    square = follow.n - follow.d**2 / follow.a
    stays = (max(square, follow.least) / follow.least) ** (-0.5 * follow.freedom) * np.sqrt(2 * np.pi / follow.a) * noise
    return float(stays / (stays + falls))
