"""A test beside what the calibrated material gives in it, with the band that a further specimen would lie in."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce

import numpy as np

from dielast.calibration.experiment import Experiment, MeasuredTest, answers_of, explained, relative_error
from dielast.calibration.fit import Fit
from dielast.calibration.laboratory import Laboratory, completed_stress, under_voltage
from dielast.calibration.likelihood import Likelihood
from dielast.calibration.voltage import VoltageTest
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.mechanics.load import Mode
from dielast.numerics.arrays import Flags, Floats, Index, rms

PARTS = 16  # equally likely parts of the scatter about a draw


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Comparison(TabularResult):
    """A test and the model: `model`, `lower` and `upper` (n,), in SI and less `rest`, as the measured values of the test.

    The interval from lower to upper covers a measured value with the level of the calibration; it includes the scatter of
    specimens, the model's error and noise. A draw that has run away counts as below every bound, as a failed film does in
    simulations: where more of them have than the interval leaves out below, its lower end is minus infinity, and where more have
    than it reaches up to, the upper end is as well. `lost` (n,) is their share. The model is NaN beyond the point from which on it
    runs away; all are NaN if the material cannot follow the test.
    """

    test: Experiment
    fitted: bool
    model: Floats
    lower: Floats
    upper: Floats
    lost: Floats | float = 0.0

    @property
    def known(self) -> Flags:
        """Which points (n,) the model has a value at."""
        return np.isfinite(self.model)

    @property
    def followed(self) -> bool:
        """Whether the material could follow the test, at least until it runs away."""
        return bool(np.all(self.known)) or self.runaway is not None

    @property
    def runaway(self) -> float | None:
        """The prescribed stretch at the last measured point before the material runs away, None if it does not."""
        known, stretch = self.known, self.test.stretch
        if stretch is None or known.all() or not known.any():
            return None
        return float(stretch[np.flatnonzero(known)[-1]])

    @property
    def slack(self) -> Flags:
        """Which points (n,) the specimen is slack at, once it has been stretched."""
        test = self.test
        if not isinstance(test, MeasuredTest) or not test.may_be_slack:
            return np.zeros(self.model.size, dtype=bool)
        return np.asarray((self.model == 0) & np.logical_or.accumulate(test.followed != 1))

    @property
    def rms_error(self) -> float:
        """Root mean square of model - measured where the model has a value, in the unit of the test; NaN if it has none."""
        return rms((self.model - self.test.measured)[self.known]) if self.known.any() else np.nan

    @property
    def rms_relative_error(self) -> float:
        """`rms_error` over the root mean square of the same measured values, less the value at rest."""
        return relative_error([self.test], [self.model - self.test.measured])

    @property
    def rms_voltage_error(self) -> float:
        """`rms_relative_error` of a voltage test, NaN for others."""
        return self.rms_relative_error if isinstance(self.test, VoltageTest) else np.nan

    @property
    def r_squared(self) -> float:
        """Share of the variance of the same measured values that the model explains; NaN if they do not vary."""
        return explained([self.test], [self.model - self.test.measured])

    @property
    def opened(self) -> float | None:
        """The prescribed stretch at the first measured point where the interval has no lower end, None if it has one everywhere."""
        opened, stretch = np.isneginf(self.lower), self.test.stretch
        return float(stretch[int(np.argmax(opened))]) if stretch is not None and opened.any() else None

    @property
    def coverage(self) -> float:
        """Share of the points within the interval, which may have no lower end; NaN if there is none."""
        inside, bounded = (self.test.measured >= self.lower) & (self.test.measured <= self.upper), ~np.isnan(self.lower)
        return float(np.mean(inside[bounded])) if bounded.any() else np.nan

    def columns(self) -> Table:
        """A row for each point."""
        return [
            Column("test", None, [self.test.name] * self.test.measured.size),
            Column("time", "s", self.test.time),
            *(
                Column(name, None, values + self.test.rest)
                for name, values in (
                    ("measured", self.test.measured),
                    ("model", self.model),
                    ("lower", self.lower),
                    ("upper", self.upper),
                )
            ),
            Column("unit", None, [self.test.unit] * self.test.measured.size),
        ]


def compare_tests(
    fit: Fit, likelihood: Likelihood, draws: Floats, stratum: Index, validate: Sequence[Experiment], level: float
) -> tuple[Comparison, ...]:
    """Comparisons of the fitted tests and those to `validate` with the model, with bands for measurements on a further specimen:
    those that hold the bands of the `draws` (draws, p) in every `stratum` (draws,).
    """
    fitted = fit.problem.laboratory.tests
    # of a scatter that is estimated: at the ends of the interval, and in equally likely parts for every draw
    width = float(likelihood.specimens.deviates(np.array(0.5 * (1 + level))))
    parts = likelihood.specimens.deviates((np.arange(PARTS) + 0.5) / PARTS)
    found = []
    for k, (test, answer) in enumerate(_answers((*fitted, *validate), fit, draws)):
        model, drawn = answer[0], answer[1:]
        follows = np.isfinite(drawn[:, 0])
        drawn, own, gone = drawn[follows], stratum[follows], ~np.isfinite(drawn[follows])
        enough = len(drawn) > 2 and bool(np.isfinite(model[0]))
        # where the fit has run away, errors are those at the middle of the draws that are left
        middle = np.where(np.isfinite(model), model, _middle(drawn)) if enough else model
        there, spread = np.isfinite(middle), np.full(model.size, np.nan)
        wide = np.broadcast_to(test.wide, model.shape)[there]
        spread[there] = np.sqrt(likelihood.scatters.variance(middle[there], wide, test.power))
        lower, upper, lost = model - width * spread, model + width * spread, np.zeros(model.size)
        if enough:
            scattered = np.where(gone, -np.inf, drawn)[:, None] + np.where(there, parts[:, None] * spread, 0.0)
            shares = (0.5 * (1 - level), 0.5 * (1 + level))
            pairs = [ordered_quantiles(scattered[own == k].reshape(-1, model.size), shares) for k in np.unique(own)]
            lower, upper = np.min([low for low, _ in pairs], axis=0), np.max([high for _, high in pairs], axis=0)
            lost = np.mean(gone, axis=0)
        found.append(Comparison(test, k < len(fitted), model, lower, upper, lost))
    return tuple(found)


def hull(of_laws: Sequence[Sequence[Comparison]]) -> tuple[Comparison, ...]:
    """The comparisons of the first law, with intervals that hold those of every law that could follow the test; none where a law
    has none.
    """
    first, *others = of_laws
    found = []
    for each in first:
        alike = [each, *(other for law in others for other in law if other.test is each.test and other.followed)]
        lower, upper = np.minimum.reduce([other.lower for other in alike]), np.maximum.reduce([other.upper for other in alike])
        lost: Floats = reduce(np.maximum, [np.asarray(other.lost) for other in alike])
        found.append(replace(each, lower=lower, upper=upper, lost=lost))
    return tuple(found)


def _middle(drawn: Floats) -> Floats:
    """The median (n,) of the draws (draws, n) that have not run away, NaN where all have."""
    ordered, count = np.sort(drawn, axis=0), np.count_nonzero(np.isfinite(drawn), axis=0)  # NaN last
    pair = [np.take_along_axis(ordered, np.maximum(place, 0)[None], axis=0)[0] for place in ((count - 1) // 2, count // 2)]
    return np.where(count > 0, 0.5 * (pair[0] + pair[1]), np.nan)


def ordered_quantiles(values: Floats, shares: Sequence[float]) -> list[Floats]:
    """The quantiles (n,) of values (k, n), of which some are minus infinity, at each of the `shares`: linear between neighbours,
    minus infinity if the lower one is.
    """
    ordered, found = np.sort(values, axis=0), []
    for share in shares:
        place = share * (len(values) - 1)
        low, high = ordered[int(place)], ordered[min(int(place) + 1, len(values) - 1)]
        with np.errstate(invalid="ignore"):
            found.append(np.where(np.isneginf(low), -np.inf, low + (place - int(place)) * (high - low)))
    return found


def _answers(tests: Sequence[Experiment], fit: Fit, draws: Floats) -> list[tuple[Experiment, Floats]]:
    """Each test with the values (1 + draws, n) of the fit and of draws (draws, p): NaN from a runaway on, all NaN if a material
    cannot follow it.
    """
    coordinates = np.concatenate((fit.coordinates[None], draws))
    materials, conditions = fit.space.materials(coordinates), fit.space.conditions(coordinates)
    electric = [test for test in tests if isinstance(test, MeasuredTest) and test.nominal_field]
    others = iter(Laboratory([test for test in tests if test not in electric]).answers(materials, conditions))
    found: list[tuple[Experiment, Floats]] = []
    for test in tests:
        if isinstance(test, MeasuredTest) and test.nominal_field:
            found.append((test, answers_of(partial(stable_stress, test), materials, test.measured.size)))
        else:
            values = next(others)
            found.append((test, np.where(np.all(np.isfinite(values), axis=1, keepdims=True), values, np.nan)))
    return found


def stable_stress(test: MeasuredTest, materials: Sequence[Material]) -> list[Floats]:
    """The stress (n,) of each material in a test under voltage, NaN beyond the last point before it runs away.

    It runs away if it becomes wider than it is long by expanding across, rather than by being unloaded. An isotropic film without
    stress across would then have to be pushed along, because the larger stress goes with the larger stretch (Baker and Ericksen
    1954): a specimen would wrinkle. A film that is held across, or stretched in both axes, cannot run away.
    """
    history = under_voltage(test, materials)
    stresses = completed_stress(history)
    if test.mode is not Mode.UNIAXIAL:
        return stresses
    for k, (length, width) in enumerate(zip(history.stretch_1, history.stretch_2, strict=True)):
        wider = width > length
        crossing = ~wider[:-1] & wider[1:] & (np.diff(width) > np.abs(np.diff(length)))
        if crossing.any():  # the stress up to there is kept even where the simulation was given up later
            stable = np.arange(length.size) <= np.argmax(crossing)
            stresses[k] = np.where(stable, history.nominal_stress_1[k], np.nan)
        elif wider[int(np.argmax(length))]:
            stresses[k][1:] = np.nan
    return stresses
