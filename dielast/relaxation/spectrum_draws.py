"""The uncertainty of a spectrum: draws of its master curve, each fitted like the curve itself.

A draw is the curve times the ratio of its resampled smooth curve to the mean of all draws, so that the draws scatter about the fit
to the curve, whatever the bias of smoothing. As no modulus is negative, refits are off to one side of the fit, and the fit is off
to the same side of the truth: every second draw is therefore the reflection, about the fit, of the refit to the opposite noise, so
that all draws are symmetric about the fit (symmetric bootstrap intervals: P. Hall, J. R. Stat. Soc. B 50 (1988) 35). Where the
curve ends before its plateau, draws are refits alone: reflected ones held fewer lives there. The equilibrium modulus of a plateau
that was reached is drawn by how likely the curve makes it (see `levels`). The distance of the fit from the curve beyond noise is a
model error that resampling does not show: every draw is shifted by that distance times a random factor of mean 0 and variance 1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dielast.base.errors import InputError, NumericsError, warn, without_warnings
from dielast.material.spectrum import Spectrum
from dielast.numerics.arrays import Flags, Floats, Index, rms
from dielast.numerics.random_streams import stream
from dielast.relaxation.beyond import continuations
from dielast.relaxation.levels import likely_levels
from dielast.relaxation.nnls import non_negative
from dielast.relaxation.result import SpectrumFit

SEED = 1  # equal draws of a master curve give equal draws of its spectrum
DOUBTED = 2.0  # ratio of misfit to scatter of the draws above which a warning is issued
TIMES_PER_DECADE = 8
LAST = 10.0  # ratio of the last time of a curve to the first of its end, over which its error as a whole is the mean
SMALL, RELUCTANCE = 0.01, 1e-6  # least fraction of the modulus that a branch counts as; squared misfit per squared relative change


@dataclass(frozen=True, slots=True, eq=False)
class CurveDraws:
    """Smooth master curves of several draws: `ordinates` (draws, c, k) at ascending `abscissa` (k,), as in `MasterCurve`."""

    abscissa: Floats
    ordinates: Floats

    def centre(self, abscissa: Floats) -> Floats:
        """The geometric mean (c, n) of all draws at abscissas (n,), constant beyond the ends."""
        return np.asarray(np.exp(np.mean(self._logarithms(abscissa), axis=0)))

    def deviations(self, abscissa: Floats) -> Floats:
        """ln of each draw over the mean of all draws, (draws, c, n), at abscissas (n,), constant beyond the ends."""
        logarithms = self._logarithms(abscissa)
        return np.asarray(logarithms - np.mean(logarithms, axis=0))

    def _logarithms(self, abscissa: Floats) -> Floats:
        """ln of the ordinates, linear in log-log between the points and constant beyond the ends."""
        x, at = np.log(self.abscissa), np.log(abscissa)
        rows = [np.interp(at, x, row) for row in np.log(self.ordinates).reshape(-1, x.size)]
        return np.reshape(rows, (*self.ordinates.shape[:2], at.size))


@dataclass(frozen=True, slots=True, eq=False)
class SpectrumDraws:
    """Draws of a spectrum on the same times `relaxation_time` (N,) in s, slowest first: `equilibrium_modulus` (draws,) and
    `shear_modulus` (draws, N) in Pa.

    `used` (draws,) are the indices of their master curves among all draws. `misfit` is the root mean square of ln(model/curve),
    `scatter` that of the draws about the curve.
    """

    used: Index
    relaxation_time: Floats
    equilibrium_modulus: Floats
    shear_modulus: Floats
    misfit: float
    scatter: float


def draw_spectra(
    abscissa: Floats,
    ordinates: Floats,
    curves: CurveDraws,
    fit: SpectrumFit,
    refit: Callable[[Floats, Floats], SpectrumFit],
    *,
    spectrum: Spectrum | None = None,
    open_end: bool = False,
    level_known: bool = False,
) -> SpectrumDraws:
    """The spectra of all draws of the master curve with points `abscissa` (n,) and `ordinates` (c, n), which gave `fit`.

    `refit` fits such points in the same way as `fit`. If it uses other relaxation times, a draw keeps the times of `fit`, with
    moduli that change the relaxation modulus by the same fraction; the same is done for a `spectrum` that was derived from that of
    the fit by other means than truncation. With an `open_end`, the curve of the `fit` ends before its plateau: every draw goes on
    in its own way (`dielast.relaxation.beyond`), with slower branches and a lower equilibrium modulus. `level_known` says that the
    equilibrium modulus is not that of the curve. Draws that cannot be fitted are omitted; raises `InputError` if these are more
    than half. Warns if the model misses the curve by far more than the draws scatter.
    """
    fitted = fit.spectrum
    change = _Change.of(fitted, fit)
    at_points = curves.deviations(fit.reduced_abscissa)
    rows: list[tuple[int, float, Floats, Floats]] = []
    for place, deviation in enumerate(curves.deviations(abscissa)):
        sense = -1 if place % 2 and not open_end else 1
        with without_warnings():
            try:
                drawn = refit(abscissa, ordinates * np.exp(sense * deviation))
            except (InputError, NumericsError):
                continue
        if not np.array_equal(drawn.reduced_abscissa, fit.reduced_abscissa):  # a point strays in this draw alone
            continue
        level, moduli = drawn.equilibrium_shear_modulus, drawn.spectrum.shear_modulus
        if sense < 0 or not _begins_with(drawn.spectrum, fitted):
            stiffer = sense * (drawn.spectrum.relaxation_modulus(change.time, level) / change.modulus - 1)
            (level,), (moduli,) = change.added(fit.equilibrium_shear_modulus, fitted.shear_modulus, stiffer[None])
        follows = sense * np.log(np.atleast_2d(drawn.model)[0] / np.atleast_2d(fit.model)[0]) - at_points[place, 0]
        rows.append((place, level, moduli[: len(fitted)], follows))
    if 2 * len(rows) < len(curves.ordinates):
        raise InputError(
            f"only {len(rows)} of {len(curves.ordinates)} draws of the master curve can be fitted: it is too uncertain for this fit"
        )
    used, equilibrium, moduli, follows = (np.array(column) for column in zip(*rows, strict=True))
    model = np.atleast_2d(fit.model)[0]
    missed = fit.kind.stiffness_power * np.log(model / curves.centre(fit.reduced_abscissa)[0])
    # the draws already contain the misfit that is due to noise
    square, noise = float(np.mean(missed**2)), float(np.mean(np.var(follows, axis=0)))
    missed = missed * np.sqrt(max(1 - noise / square, 0.0)) if square > 0 else missed
    misfit, scatter = rms(missed), rms(curves.deviations(curves.abscissa)[:, 0])
    if misfit > DOUBTED * scatter:
        warn(
            f"the model misses the curve by {misfit:.2%} rms, far more than the {scatter:.2%} by which noise makes the curve "
            "uncertain: the draws allow for it, but stand about a spectrum that is off"
        )
    share = stream(SEED, "model error").standard_normal(len(curves.ordinates))[used]
    distance = np.interp(np.log(change.time), np.log(fit.reduced_time), missed)
    equilibrium, moduli = change.added(equilibrium, moduli, share[:, None] * distance)
    if open_end:
        of_draws = equilibrium[:, None] + moduli @ np.exp(-fit.reduced_time / fitted.relaxation_time[:, None])
        ratios = of_draws / fitted.relaxation_modulus(fit.reduced_time, fit.equilibrium_shear_modulus)
        tau, equilibrium, moduli = continuations(fit, ratios, 1).joined(fitted, equilibrium, moduli)
        fit = replace(fit, spectrum=Spectrum(tau, moduli.mean(axis=0)), equilibrium_shear_modulus=float(equilibrium.mean()))
        fitted = fit.spectrum
    elif not level_known and fit.smoothing is not None and fit.retardation is None and fit.equilibrium_shear_modulus > 0:
        equilibrium, moduli = _levelled(fit, equilibrium, moduli, curves, used)
    if spectrum is not None and _begins_with(fitted, spectrum):
        moduli = moduli[:, : len(spectrum)]
    elif spectrum is not None:
        change = _Change.of(spectrum, fit)
        stiffer = (equilibrium[:, None] + moduli @ np.exp(-change.time / fitted.relaxation_time[:, None])) / change.modulus - 1
        equilibrium, moduli = change.added(fit.equilibrium_shear_modulus, spectrum.shear_modulus, stiffer)
    tau = (fitted if spectrum is None else spectrum).relaxation_time
    return SpectrumDraws(used, tau, equilibrium, moduli, misfit, scatter)


def _levelled(fit: SpectrumFit, equilibrium: Floats, moduli: Floats, curves: CurveDraws, used: Index) -> tuple[Floats, Floats]:
    """Draws with equilibrium moduli (draws,) as likely as the curve makes them, and moduli (draws, N) that change the relaxation
    modulus of each draw within the curve as little as they can.
    """
    count, random = len(curves.ordinates), stream(SEED, "equilibrium modulus")
    ratio = likely_levels(fit, (random.permutation(count) + random.uniform(size=count)) / count)[used]
    time, tau = fit.reduced_time, fit.spectrum.relaxation_time
    change = _Change.of(fit.spectrum, fit)
    own = equilibrium[:, None] + moduli @ np.exp(-change.time / tau[:, None])
    last = (change.time >= time[-1] / LAST) & (change.time <= time[-1])
    offset = np.mean(np.log(own[:, last] / change.modulus[last]), axis=1)
    # the error of the whole curve, less the noise of its last points, which is in the ratio
    missed = np.log(np.atleast_2d(fit.measured)[0] / np.atleast_2d(fit.model)[0])
    noise = float(np.mean(missed**2)) / np.count_nonzero(time >= time[-1] / LAST)
    offset *= np.sqrt(max(1 - noise / np.var(offset), 0.0)) if np.any(offset) else 1.0
    level = fit.equilibrium_shear_modulus * ratio * np.exp(offset)
    within = change.time <= time[-1]
    return level, change.held(level, moduli, own, within)


def _begins_with(spectrum: Spectrum, with_these: Spectrum) -> bool:
    """Whether the slowest relaxation times of a spectrum are those of the spectrum `with_these`."""
    count = len(with_these)
    return len(spectrum) >= count and np.allclose(spectrum.relaxation_time[:count], with_these.relaxation_time, rtol=1e-6)


@dataclass(frozen=True, slots=True, eq=False)
class _Change:
    """The changes of a spectrum that change its relaxation `modulus` (k,) in Pa at `time` (k,) in s by given fractions.

    They are the smallest relative changes, in terms of `size` (N + 1,) in Pa of the moduli and the equilibrium modulus, that nearly
    suffice and leave no modulus below 0: least squares with the `effect` (k, N + 1) of such changes.
    """

    time: Floats
    modulus: Floats
    size: Floats
    effect: Floats

    @classmethod
    def of(cls, target: Spectrum, fit: SpectrumFit) -> Self:
        """For a `target` in place of the spectrum of a fit."""
        tau, equilibrium = target.relaxation_time, fit.equilibrium_shear_modulus
        # after its slowest time a melt has next to no modulus, of which a draw with other times is any multiple
        first, last = tau[-1] / 2, tau[0] * (10 if equilibrium > 0 else 1)
        time = np.geomspace(first, last, int(TIMES_PER_DECADE * np.log10(last / first)) + 1)
        modulus, carried = fit.spectrum.relaxation_modulus(time, equilibrium), target.relaxation_modulus(tau, equilibrium)
        of_equilibrium = max(equilibrium, SMALL * carried[0]) if equilibrium > 0 else 0.0  # a melt stays one
        size = np.append(np.maximum(target.shear_modulus, SMALL * carried), of_equilibrium)
        effect = np.column_stack([np.exp(-time[:, None] / tau), np.ones(time.size)]) * size / modulus[:, None]
        return cls(time, modulus, size, effect)

    def added(self, equilibrium: Floats | float, moduli: Floats, share: Floats) -> tuple[Floats, Floats]:
        """Equilibrium modulus (draws,) and moduli (draws, N) after changes by the fractions `share` (draws, k)."""
        reluctance = RELUCTANCE * self.time.size * np.eye(self.size.size)
        before = np.empty((len(share), self.size.size))
        before[:, -1], before[:, :-1] = equilibrium, moduli
        after = before + self.size * np.linalg.solve(self.effect.T @ self.effect + reluctance, self.effect.T @ share.T).T
        equations, size = np.concatenate((self.effect, np.sqrt(reluctance))), np.where(self.size > 0, self.size, 1.0)
        for row in np.flatnonzero(np.any(after < 0, axis=1)):
            # setting the negative ones to 0 would undo much of the change, which other moduli can bring about
            wanted = equations @ (before[row] / size) + np.append(share[row], np.zeros(size.size))
            after[row] = self.size * non_negative(equations, wanted)[0]
        return after[:, -1], after[:, :-1]

    def held(self, level: Floats, moduli: Floats, wanted: Floats, within: Flags) -> Floats:
        """The moduli (draws, N) that relax as `wanted` (draws, k) at the times `within`, to the moduli `level` (draws,)."""
        size, reluctance = self.size[:-1], np.sqrt(RELUCTANCE * np.count_nonzero(within))
        effect = self.effect[within, :-1] * self.modulus[within, None]
        after = []
        for constant, before, modulus in zip(level, moduli, wanted[:, within], strict=True):
            equations = np.vstack([effect / modulus[:, None], reluctance * np.eye(size.size)])
            after.append(size * non_negative(equations, np.append(1 - constant / modulus, reluctance * before / size))[0])
        return np.array(after)
