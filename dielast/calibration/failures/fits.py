"""Fitted laws of failure: parameters with intervals and verdicts, draws, ranks of specimens, lives under constant voltages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp, pdtr, pdtrc

from dielast.base.errors import InputError, without_warnings
from dielast.calibration.failures.bounds import most_expected
from dielast.calibration.failures.estimate import Estimate, estimate, starts_of, without_each
from dielast.calibration.failures.exposures import Aged
from dielast.calibration.failures.histories import Histories
from dielast.calibration.failures.law_models import law_model
from dielast.calibration.failures.laws import LawModel
from dielast.calibration.failures.likelihood import Anchored, Seen
from dielast.calibration.failures.possible import ProfileInterval, draw, edge, profile_intervals
from dielast.calibration.failures.specimens import Simulated, Specimens
from dielast.calibration.profiles import Verdict
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.intervals import interval
from dielast.material.material import Material
from dielast.numerics.arrays import Floats

LIVES = 1000  # draws for intervals of lives, at least
RARE = 0.01  # probability below which failures are not of one kind


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FailureFit(TabularResult):
    """A `law` with its `fit`, profile-likelihood `intervals` of the free coordinates at the `level`, and `draws` (draws, p) of the
    coordinates. `mode` is the kind of failure that it describes, "" for all. The table is that of the parameters.
    """

    law: LawModel
    fit: Estimate
    intervals: tuple[ProfileInterval, ...]
    draws: Floats
    level: float
    mode: str = ""
    edge: Floats | None = None
    """Coordinates on the edge of the likelihood region of intervals (see `draws.edge`)."""

    @property
    def name(self) -> str:
        """The name of the law."""
        return self.law.name

    def material(self, material: Material) -> Material:
        """The material with the fitted law."""
        return self.law.material(material, self.fit.at)

    def interval_of(self, coordinate: int) -> ProfileInterval:
        """The interval of a coordinate."""
        place = np.flatnonzero(self.fit.free == coordinate)
        at = float(self.fit.at[coordinate])
        return self.intervals[int(place[0])] if place.size else ProfileInterval(at, at, Verdict.DETERMINED)

    def bounds(self, drawn: Floats) -> tuple[Floats, Floats]:
        """Lower and upper bounds (n,) at the level, of what was `drawn` (draws, n)."""
        return interval(drawn, self.level)

    def columns(self) -> Table:
        """A row for each parameter, in SI; numbers that the specimens do not determine are NaN."""
        rows: list[tuple[float, ...]] = []
        verdicts = []
        for parameter in self.law.parameters:
            k = parameter.coordinate
            at, found = float(self.fit.at[k]), self.interval_of(k)
            ends = [float(parameter.value(end)) for end in (found.lower, found.upper)]
            falls = parameter.sign < 0
            verdict = found.verdict
            if falls:
                ends = ends[::-1]
                verdict = {Verdict.LOWER: Verdict.UPPER, Verdict.UPPER: Verdict.LOWER}.get(verdict, verdict)
            error = float(self.fit.standard_error[k]) * parameter.slope(at)
            only_bound = not self.law.model.observations.failures and verdict is not Verdict.DETERMINED
            value = np.nan if verdict is Verdict.UNDETERMINED or only_bound else float(parameter.value(at))
            rows.append((value, error if verdict is Verdict.DETERMINED else np.nan, *ends))
            verdicts.append("known" if self.fit.fixed[k] else str(verdict))
        numbers = np.array(rows).reshape(-1, 4).T
        names = ("value", "standard_error", "lower", "upper")
        return [
            Column("parameter", None, [parameter.name for parameter in self.law.parameters]),
            *(Column(name, None, values) for name, values in zip(names, numbers, strict=True)),
            Column("verdict", None, verdicts),
            Column("unit", None, [parameter.unit for parameter in self.law.parameters]),
            *([Column("mode", None, [self.mode] * len(verdicts))] if self.mode else []),
        ]

    @property
    def hazard(self) -> Floats:
        """The cumulative hazard (n,) of each specimen of the law at its end; its mean is 1 for specimens that fail as the law
        says. Of a specimen that was found failed, it is that in the middle of the probability since it was last seen intact.
        """
        low, high = self.hazards
        failed = -np.expm1(-low), -np.expm1(-high)
        return np.asarray(np.where(low == high, high, -np.log1p(-0.5 * (failed[0] + failed[1]))))

    @property
    def hazards(self) -> tuple[Floats, Floats]:
        """The cumulative hazards (n,) of each specimen when it was last known to be intact, and at its end."""
        model = self.law.model
        v, later = model.places(self.fit.at[None])
        area = model.observations.log_area
        first, last = (-model.scatter.log_survival(at, self.fit.at[None, -1:], area).value[0] for at in (v, later))
        return np.where(model.observations.seen == Seen.DEAD, 0.0, first), np.asarray(last)

    def standing(self) -> Floats:
        """v (n,) of each specimen: its log exposure over that typical of the material, of the reference area; of one that was found
        failed, that of its `hazard`.
        """
        model = self.law.model
        area = np.exp(self.fit.at[-1]) * model.observations.log_area if model.scatter.scales_with_area else 0.0
        found = np.isin(model.observations.seen, (Seen.DEAD, Seen.BETWEEN))
        found &= np.isfinite(self.plain_standing())
        share = np.where(found, np.clip(-np.expm1(-self.hazard), 1e-12, 1 - 1e-12), 0.5)
        middle = model.scatter.quantile(share, self.fit.at[-1])
        return np.asarray(np.where(found, middle, self.plain_standing() + area))

    def plain_standing(self) -> Floats:
        """v (n,) of each specimen at its end, with its own area."""
        return np.asarray(self.law.model.places(self.fit.at[None])[1][0])

    def hazard_along(self, histories: Histories, films: Specimens) -> Floats:
        """The cumulative hazard (rows,) of the first of further films along its history."""
        square, at = films.equibiaxial[:1], self.fit.at[None]
        v = self.law.along(histories.of(np.array([0])), square, films.thickness[:1], films.temperature[:1], at)[:, 0]
        return np.asarray(-self.law.model.scatter.log_survival(v, at[:, -1:], np.zeros(1)).value[0])

    def line_life(self, voltage: float, share: float) -> tuple[float, float, float]:
        """The time in s within which a share fails at a constant voltage in V, by a law of the time over the voltage, with
        bounds.
        """
        exposure = self.law.model.exposure
        assert isinstance(exposure, Aged)
        assert self.edge is not None
        at = np.concatenate((self.fit.at[None], self.edge))
        g = exposure.ageing.at(np.log(voltage), at[:, 1])[0]
        life = np.exp(at[:, 0] - g + self.law.model.scatter.quantile(np.array(share), at[:, 2]))
        return float(life[0]), float(life[1:].min()), float(life[1:].max())

    def ranks(self) -> Floats:
        """Plotting positions (n,) of the failures by exposure, NaN for survivors: Johnson's adjusted ranks i (The Statistical
        Treatment of Fatigue Experiments (1964)) at Benard's (i - 0.3)/(n + 0.4).
        """
        standing, seen = self.standing(), self.law.model.observations.seen
        order = np.lexsort((seen == Seen.SUSPENDED, standing))
        n, rank, result = order.size, 0.0, np.full(order.size, np.nan)
        for place, row in enumerate(order.tolist()):
            if seen[row] != Seen.SUSPENDED:
                rank += (n + 1 - rank) / (n + 1 - place)
                result[row] = (rank - 0.3) / (n + 0.4)
        return result

    def unlike(self) -> tuple[str, int]:
        """How the failures deviate from one kind, and at how many failures: "early" for more than the law expects up to some
        exposure, "late" for fewer, "" where they do not.

        Under the law, the number of failures up to a cumulative hazard h is Poisson distributed about the sum of min(H_i, h)
        (Cox and Snell 1968, DOI 10.1111/j.2517-6161.1968.tb00724.x), tested at every failure (Bonferroni).
        """
        failed = self.law.model.observations.seen != Seen.SUSPENDED
        if np.count_nonzero(failed) < 4:
            return "", 0
        # a failure that was found later counts when it speaks least for a deviation
        for kind, tail, hazard in (("early", pdtrc, self.hazards[1]), ("late", pdtr, self.hazards[0])):
            at = np.sort(hazard[failed])
            expected = np.minimum(hazard[None], at[:, None]).sum(axis=1)
            count = np.arange(1, at.size + 1)
            rare = tail(count - 1, expected) < RARE / (2 * at.size)
            if np.any(rare):
                return kind, int(count[np.argmax(rare)])
        return "", 0


def fit_law(law: LawModel, *, level: float = 0.9, draws: int = 200, seed: int = 1, mode: str = "") -> FailureFit:
    """Fit a law; without `draws`, bounds of lives by competing kinds of failure are not known.

    Raises `InputError` for fewer failures than parameters and `NumericsError` where no start has a likelihood.
    """
    fit = estimate(law.model, law.known)
    if not fit.fixed[-1] and fit.at[-1] <= law.model.bounds[0][-1]:
        raise InputError("the failures do not scatter about the law: state the scatter, or voltages and times with more digits")
    intervals = tuple(profile_intervals(fit, level))
    drawn = draw(fit, max(draws, LIVES) if draws else 0, seed)
    return FailureFit(law, fit, intervals, drawn, level, mode, edge(fit, level, seed))


def bounded_law(law: LawModel, level: float = 0.9) -> FailureFit:
    """The lower bound of the location that survivors alone give at a one-sided confidence `level`, with all other coordinates known
    (Weibayes): the location L at which the cumulative hazards of all specimens add up to -ln(1 - level).
    """
    at, fixed = starts_of(law.model)[0], np.ones(len(law.model.names), dtype=bool)
    fixed[0] = False
    for name, value in law.known.items():
        at[law.model.names.index(name)] = value
    _, slope, scatter = law.model.parts(at[None])
    y = law.model.exposure.at(slope).y[0, : law.rows.size]
    sigma = float(np.exp(scatter[0, 0]))
    place = sigma * (logsumexp(y / sigma + law.model.observations.log_area) - np.log(most_expected(0, level)))
    location = law.model.location
    if isinstance(location, Anchored):
        place = float(location.ageing.field_of(place - np.log(location.time), slope[0, 0]))
    at[0] = place
    fit = Estimate(law.model, at, float(law.model.total(at[None])[0]), np.zeros((at.size, at.size)), fixed)
    found = ProfileInterval(float(at[0]), np.nan, Verdict.LOWER)
    return FailureFit(law, fit, (found,), np.tile(at, (LIVES, 1)), level)


def history_error(fitted: FailureFit, tested: Simulated) -> float:
    """The largest change of the log exposure of a specimen at its end, over its scatter, without every second row of the histories.

    As fields are interpolated to second order, the rows that are there leave about a third of it as an error (Richardson 1911,
    DOI 10.1098/rsta.1911.0009). It is infinite where the law does not describe the specimens along the fewer rows.
    """
    at, law = fitted.fit.at[None], fitted.law
    try:
        with without_warnings():
            other = law_model(law.name, replace(tested, histories=tested.histories.coarser()), law.options)
    except InputError:
        return np.inf
    changes = [
        (a - b)[np.isfinite(a)] for a, b in zip(law.model.places(at), other.model.places(at), strict=True)
    ]  # an exposure of 0 has the log -inf
    return float(np.max(np.abs(np.concatenate(changes)), initial=0.0) / np.exp(at[0, -1]))


def left_out_score(fitted: FailureFit) -> float:
    """The log likelihood of every specimen under the fit of the others, their sum."""
    values = without_each(fitted.fit)[1]
    return float(np.sum(np.where(np.isfinite(values), values, -1e3)))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Lives(TabularResult):
    """Lives in s of films under constant `voltage` (films,) in V, of `prestretch` (films, 2): `time` (shares, films) within which
    each of the `shares` of films fails, with bounds `lower` and `upper`; infinite beyond the horizon.
    """

    voltage: Floats
    prestretch: Floats
    shares: tuple[float, ...]
    time: Floats
    lower: Floats
    upper: Floats

    def columns(self) -> Table:
        """The table, one row per film."""
        return [
            Column("voltage", "V", self.voltage),
            Column("prestretch_1", "1", self.prestretch[:, 0]),
            Column("prestretch_2", "1", self.prestretch[:, 1]),
            *(
                Column(f"time_b{100 * share:g}{end}", "s", values[k])
                for k, share in enumerate(self.shares)
                for end, values in (("", self.time), ("_lower", self.lower), ("_upper", self.upper))
            ),
        ]


def lives_of(
    fitted: Sequence[FailureFit],
    films: Simulated,
    *,
    shares: Sequence[float] = (0.01, 0.1, 0.5, 0.9),
) -> Lives:
    """The lives of films of the reference area under constant voltages, whose histories end at a horizon or at pull-in. They fail
    by the first of several competing kinds of failure, one for each of the fitted laws, or by pull-in.
    """
    # of one kind of failure, the ends of profile-likelihood intervals; of several, quantiles of draws
    alone = fitted[0].edge if len(fitted) == 1 else None
    spread = [law.draws if alone is None else alone for law in fitted]
    time = _lives([law.fit.at[None] for law in fitted], fitted, films, shares)[0]
    others = _lives(spread, fitted, films, shares)
    lower, upper = interval(others, fitted[0].level) if alone is None else (others.min(axis=0), others.max(axis=0))
    if not all(law.law.model.observations.failures for law in fitted):  # lower bounds alone
        time, upper = np.full_like(time, np.inf), np.full_like(upper, np.inf)
    return Lives(films.specimens.voltage, films.specimens.prestretch, tuple(shares), time, lower, upper)


def life_error(fitted: Sequence[FailureFit], films: Simulated) -> float:
    """The largest relative change of a life within the horizon, of 10 % and of 50 % of films, without every second row of the
    histories, of which a third is an error (see `history_error`).
    """
    at = [law.fit.at[None] for law in fitted]
    coarser = replace(films, histories=films.histories.coarser())
    one, other = (_lives(at, fitted, rows, (0.1, 0.5))[0] for rows in (films, coarser))
    known = np.isfinite(one) & np.isfinite(other) & (one > 0) & (other > 0)
    return float(np.max(np.abs(np.log(one[known] / other[known])), initial=0.0))


def _lives(at: Sequence[Floats], fitted: Sequence[FailureFit], films: Simulated, shares: Sequence[float]) -> Floats:
    """Lives (k, shares, films) in s at coordinates (k, p) of each of the fitted laws."""
    specimens = films.specimens
    square, parts = specimens.equibiaxial, []
    for film in range(square.size):
        one = films.histories.of(films.film[[film]])
        hazard: Floats | float = 0.0
        for law, coordinates in zip(fitted, at, strict=True):
            v = law.law.along(one, square[[film]], specimens.thickness[[film]], specimens.temperature[[film]], coordinates)[:, 0]
            hazard = hazard - law.law.model.scatter.log_survival(v, coordinates[:, -1:], np.array(0.0)).value
        parts.append(_crossings(np.asarray(hazard), one.time[0], shares, float(films.pulled_in[film])))
    return np.stack(parts, axis=2)


def _crossings(hazard: Floats, time: Floats, shares: Sequence[float], pulled_in: float) -> Floats:
    """The times (k, shares) at which cumulative hazards (k, rows) reach those of the shares; at the latest that of pull-in."""
    result = np.empty((hazard.shape[0], len(shares)))
    rows = np.arange(hazard.shape[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        logs, log_time = np.log(hazard), np.log(time)
        for k, share in enumerate(shares):
            needed = -np.log1p(-share)
            reached = hazard >= needed
            place = np.argmax(reached, axis=1)
            before = np.maximum(place - 1, 0)
            part = (np.log(needed) - logs[rows, before]) / (logs[rows, place] - logs[rows, before])
            linear = (needed - hazard[rows, before]) / (hazard[rows, place] - hazard[rows, before])
            by_log = np.exp(log_time[before] + part * (log_time[place] - log_time[before]))
            by_time = time[before] + linear * (time[place] - time[before])
            at = np.where(np.isfinite(by_log) & (time[before] > 0), by_log, by_time)
            at = np.where(place == 0, time[0], at)
            result[:, k] = np.where(reached.any(axis=1), np.minimum(at, pulled_in), pulled_in)
    return result
