"""Draws of a master curve: shift factors, shift law and smooth curves, together as uncertain as the tests leave them.

The shift factors of a draw scatter as their covariance states. With shift factors given, the smooth curves, and the offsets and
tilts of all curves, are a linear problem with normal errors, from whose solution they are drawn (the mixed model of G. K. Robinson,
Stat. Sci. 6 (1991) 15). So a curve that is shifted too far in a draw is raised by as much as its neighbours ask for. An error of a
temperature changes the shift factor of its curve but not the place of the curve among the others. Draws are about the smooth
curve through the curves as measured; how far offsets and tilts move it is an error, of which every draw has a random multiple.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dielast.base.errors import InputError, NumericsError, without_warnings
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.measurement import Measurement
from dielast.material.shift import ShiftLaw
from dielast.numerics.arrays import Floats, Index
from dielast.numerics.random_streams import stream
from dielast.relaxation.superposition.effects import OFFSET, TILT, RandomEffect
from dielast.relaxation.superposition.joint_fit import fit_state
from dielast.relaxation.superposition.joint_problem import LOOSE, Prior, State, with_random
from dielast.relaxation.superposition.mastercurve import Vertical, prepare
from dielast.relaxation.superposition.points import FitPoints, points_of
from dielast.relaxation.superposition.result import MasterCurve
from dielast.relaxation.superposition.shiftfit import fit_shift_law

GRID = 100  # reduced times at which the curves of all draws are stored


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MasterCurveDraws(TabularResult):
    """Draws of a master curve of m temperatures, one row per draw.

    `log10_shift_factor` and `vertical_shift` (draws, m) at `temperature` (m,) in degC are NaN where a draw does not determine them.
    `law_parameters` (draws, p) are the parameters of the shift `law` that vary between draws, in the units of `law.drawn`.
    `smooth_ordinates` (draws, c, k) are the smooth curves at `smooth_abscissa` (k,), both as in `MasterCurve`.
    `number` (draws,) numbers the draws from 0; draws without a master curve are missing.
    """

    number: Index
    temperature: Floats
    log10_shift_factor: Floats
    vertical_shift: Floats
    law: ShiftLaw
    law_parameters: Floats
    smooth_abscissa: Floats
    smooth_ordinates: Floats

    def columns(self) -> Table:
        """The shift factors of all draws, one draw after another."""
        count, m = self.log10_shift_factor.shape
        return [
            Column("draw", None, np.repeat(self.number, m)),
            Column("temperature", "degC", np.tile(self.temperature, count)),
            Column("log10_shift_factor", "1", self.log10_shift_factor.ravel()),
            Column("vertical_shift", "1", self.vertical_shift.ravel()),
        ]

    def stderr(self) -> dict[str, float]:
        """Standard errors of the law's parameters by name: the standard deviations of the draws."""
        spread = np.std(self.law_parameters, axis=0, ddof=1)
        return dict(zip((name for name, _ in self.law.drawn()), spread.tolist(), strict=True))


def bootstrap_master_curve(
    curves: Sequence[Measurement],
    master: MasterCurve,
    *,
    draws: int,
    seed: int = 1,
    law: str = "wlf",
    vertical: Vertical = "none",
    thermal_expansion: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> MasterCurveDraws:
    """Draws of the `master` curve that `build_master_curve` made from `curves` with the same arguments.

    A draw depends only on `seed` and its number. `progress` is called with the number of finished draws and the total. Units and
    shapes are those of `MasterCurveDraws`. Raises `InputError` for fewer than two draws, and `NumericsError` if less than half of
    them give a shift law.
    """
    if (draws := int(draws)) < 2:
        raise InputError(f"{draws} draws: at least 2 are needed")
    if not curves:
        raise InputError("at least one curve is needed", argument="curves")
    reference, kind, place = master.reference_temperature, master.kind, master.placing
    with without_warnings():
        data, binned, imposed = prepare(curves, reference, vertical, float(thermal_expansion), master.ramp)
    known, m = place.determined, place.shift.size
    within = np.where(np.isfinite(place.covariance), place.covariance, 0.0)
    scatter = _root(within)
    # a curve without a shift factor moves with the nearest one that has one
    leader = np.flatnonzero(known)[np.argmin(np.abs(np.subtract.outer(np.arange(m), np.flatnonzero(known))), axis=1)]
    measured = (within[:m, :m] + np.diag(place.thermometer**2))[np.ix_(known, known)]
    smooth = _Smooth.of(points_of(binned), master, data.order, vertical == "free")
    grid = np.geomspace(master.smooth_abscissa[0], master.smooth_abscissa[-1], GRID)
    x = kind.time_power * np.log10(grid)
    level = np.array([np.interp(reference, master.temperature, row) for row in np.eye(m)])
    usual = smooth(x - place.origin, np.zeros(2 * m), None) - level @ place.vertical
    centre = kind.stiffness_power * np.log10(_on_grid(master, grid))
    corrected = usual - centre
    rows: list[tuple[int, Floats, Floats, Floats, Floats]] = []
    for draw in range(draws):
        random = stream(seed, "measurements", draw)
        moved = scatter @ random.standard_normal(2 * m)
        shifted = moved[:m] + place.thermometer * random.standard_normal(m)
        base = shifted[place.anchor]
        shifted -= base
        origin = float(place.weight @ shifted) + np.sqrt(place.excess) * random.standard_normal()
        moved[:m] = moved[leader]
        raised = float(level @ (place.vertical + moved[m:]))
        curve = smooth(x - place.origin - origin - base, moved, random) - raised - usual + centre
        curve += corrected * random.standard_normal()
        if progress is not None:
            progress(draw + 1, draws)
        try:
            with without_warnings():
                drawn = _law_values(law, master, place.shift + shifted, measured)
                values = master.shift_fit.doubted(drawn, stream(seed, "law", draw))
                master.law.redrawn(values.tolist())  # no material relaxes more slowly when it is warmer
        except (InputError, NumericsError):
            continue
        shift = np.where(known, master.log10_shift_factor + shifted - origin, np.nan)
        vertical_shift = np.where(known, 10 ** (place.vertical + moved[m:] - raised + imposed), np.nan)
        rows.append((draw, shift, vertical_shift, values, 10 ** (kind.stiffness_power * curve)))
    if 2 * len(rows) < draws:
        raise NumericsError(f"only {len(rows)} of {draws} draws give a shift law: the data are too poor for an uncertainty")
    number, shifts, verticals, laws, ordinates = (np.array(column) for column in zip(*rows, strict=True))
    return MasterCurveDraws(number, master.temperature, shifts, verticals, master.law, laws, grid, ordinates)


@dataclass(frozen=True, slots=True, eq=False)
class _Smooth:
    """Smooth curves at parameters `theta` (3m,), with offsets and tilts that have a prior; `fit` is the state of the best ones."""

    fit: State
    theta: Floats

    @classmethod
    def of(cls, points: FitPoints, master: MasterCurve, order: Index, vertical: bool) -> Self:
        """Fit the points at the places of the curves in `master`."""
        m, place = points.curves, master.placing
        theta = np.concatenate((place.shift, place.vertical, np.zeros(m)))
        tilts = RandomEffect(TILT, master.tilt_spread)
        random = (tilts,) if vertical else (RandomEffect(OFFSET, master.offset_spread, master.stated.walk(order)), tilts)
        prior = with_random(Prior(theta, np.eye(3 * m) * LOOSE, np.arange(3 * m), 0.0), random, m)
        free = prior.random_parameters(m)
        prior = replace(prior, free=free, freedom=float(free.size), random=())  # their spreads are not fitted again
        return cls(fit_state(points, theta, prior)[0], theta)

    def __call__(self, x: Floats, moved: Floats, random: np.random.Generator | None) -> Floats:
        """log10 of the moduli (c, k) at log times `x` (k,) with shifts and vertical shifts `moved` by (2m,): drawn, or, without
        random numbers, the best ones; extrapolated linearly.
        """
        theta = self.theta.copy()
        theta[: moved.size] += moved
        state = self.fit.at(theta)
        free = state.prior.free
        effects = -np.linalg.solve(state.normal, state.gradient)
        noise = np.zeros(state.coefficient.size)
        if random is not None:
            root = np.sqrt(self.fit.repeated)
            effects += root * np.linalg.solve(np.linalg.cholesky(state.normal).T, random.standard_normal(free.size))
            noise = root * np.linalg.cholesky(state.inverse) @ random.standard_normal(noise.size)
        coefficient = state.coefficient + state.inverse @ state.cross[:, free] @ effects + noise
        return np.stack([spline.extended(x) for spline in state.curves.splines(coefficient)])


def _law_values(law: str, master: MasterCurve, shift: Floats, measured: Floats) -> Floats:
    """The numbers of a law that is fitted to other shift factors (m,), with the covariance `measured` of those determined."""
    known, anchor = master.placing.determined, master.placing.anchor
    number = int(np.sum(known[:anchor]))
    relative = np.eye(len(measured))
    relative[:, number] -= 1
    covariance = relative @ measured @ relative.T
    fitted = fit_shift_law(law, master.temperature[known], shift[known], covariance, number, master.reference_temperature)
    return master.law.numbers_of(fitted.law)


def _root(covariance: Floats) -> Floats:
    """A matrix whose product with independent standard normal numbers has this covariance."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _on_grid(master: MasterCurve, grid: Floats) -> Floats:
    """Smooth curves (c, k) through all points at the abscissas `grid` (k,), extrapolated linearly in log-log."""
    x, at = np.log(master.smooth_abscissa), np.log(grid)
    before, after = np.minimum(at - x[0], 0.0), np.maximum(at - x[-1], 0.0)
    rows = []
    for y in np.log(master.smooth_ordinates):
        beyond = before * (y[1] - y[0]) / (x[1] - x[0]) + after * (y[-1] - y[-2]) / (x[-1] - x[-2])
        rows.append(np.exp(np.interp(at, x, y) + beyond))
    return np.array(rows)
