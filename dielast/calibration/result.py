"""The result of a calibration: parameters with verdicts, tests with errors and bands, draws."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dielast.calibration.comparison import Comparison, compare_tests
from dielast.calibration.experiment import Experiment, MeasuredTest, explained, relative_error
from dielast.calibration.fit import STARTS, Fit, Watch, fit_material
from dielast.calibration.likelihood import Likelihood, likelihood_of
from dielast.calibration.parameters import Free
from dielast.calibration.posterior import draw
from dielast.calibration.profiles import Profile, Verdict, possible_values, profiles_of
from dielast.calibration.scatter import specimen_factors
from dielast.calibration.strata import open_parameters
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table, joined
from dielast.material.argument_types import checked
from dielast.material.intervals import fewest_draws, strata_of
from dielast.material.material import CalibratedRange, Material
from dielast.mechanics.load import Mode
from dielast.numerics.arrays import Floats
from dielast.simulate.options import Options

LEVEL = 0.9


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Intervals(Options):
    """`level` is the probability that an interval covers, `draws` the number of draws of the parameters from their posterior, 0 for
    none, made with `seed`.
    """

    level: float = LEVEL
    draws: int = 200
    seed: int = 1


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration(TabularResult):
    """A material fitted to tests: the `fit`, the uncertainty of its parameters, and the comparison with the tests.

    `profiles` and `draws` (draws, p), which are of the coordinates, are empty if the fit was interrupted. `level` is that of all
    intervals. The table is that of the parameters.
    """

    fit: Fit
    likelihood: Likelihood
    profiles: tuple[Profile, ...]
    draws: Floats
    comparisons: tuple[Comparison, ...]
    level: float = LEVEL
    not_followed: tuple[str, ...] = field(default=())
    """Tests that the material cannot follow."""

    @property
    def material(self) -> Material:
        """The fitted material, with the range of the tests."""
        return replace(self.fit.material, calibrated=self.range)

    @property
    def range(self) -> CalibratedRange:
        """The range of the tests, with the scatter of further specimens and of the model about draws of the parameters."""
        scatters = self.likelihood.scatters
        freedom, names = float(self.likelihood.value_freedom), self.fit.space.names
        undetermined = tuple(names[k] for k in open_parameters(self.fit.space, self.profiles))
        return replace(
            range_of(self.fit),
            specimen_scatter=scatters.specimen,
            model_error=scatters.model_error,
            scatter_freedom=freedom,
            undetermined=undetermined if len(self.draws) else (),
        )

    @property
    def materials(self) -> tuple[Material, ...]:
        """The material of each draw."""
        known = self.range
        return tuple(
            replace(material, calibrated=known) for material in self.fit.space.materials(self.draws) if material is not None
        )

    @property
    def verdicts(self) -> dict[str, str]:
        """The verdict on each parameter, by its path: determined, a lower or upper bound, or undetermined."""
        return {name: str(profile.verdict) for name, profile in zip(self.fit.space.names, self.profiles, strict=False)}

    @property
    def specimen_factors(self) -> dict[str, float]:
        """The stress of each specimen over that of the material, by specimen."""
        names = list(dict.fromkeys(test.specimen for test in self.fit.problem.laboratory.tests))
        factors = specimen_factors(self.fit.curves, self.fit.scatter, self.fit.curves.differences)
        return dict(zip(names, np.exp(factors).tolist(), strict=True))

    def total(self, fitted: bool) -> tuple[float, float]:
        """Relative rms error (`relative_error`) and share of explained variance, over all points of the fitted or of the predicted
        tests.
        """
        chosen = [comparison for comparison in self.comparisons if comparison.fitted is fitted and comparison.followed]
        if not chosen:
            return np.nan, np.nan
        misses = [comparison.model - comparison.test.measured for comparison in chosen]
        tests = [comparison.test for comparison in chosen]
        return relative_error(tests, misses), explained(tests, misses)

    def columns(self) -> Table:
        """A row for each parameter, in SI; `lower` and `upper` are all that is known of one that is not determined. Unknown
        numbers are NaN.
        """
        space, profiles = self.fit.space, self.profiles
        rows = list(enumerate(space.parameters))
        verdicts = [str(profiles[k].verdict) if profiles else "" for k, _ in rows]
        value = np.array([float(parameter.value(self.fit.coordinates[k])) for k, parameter in rows])
        units = [abs(value[k]) if parameter.scale is None else parameter.scale for k, parameter in rows]  # of the coordinates
        error = units * self.likelihood.standard_error
        ends = [
            np.array([float(parameter.value(getattr(profiles[k], side))) if profiles else np.nan for k, parameter in rows])
            for side in ("lower", "upper")
        ]
        determined = np.array([verdict in ("", Verdict.DETERMINED) for verdict in verdicts])
        return [
            Column("parameter", None, list(space.names)),
            Column("start", None, np.array([parameter.start for _, parameter in rows])),
            Column("value", None, np.where(determined, value, np.nan)),
            Column("standard_error", None, np.where(determined, error, np.nan)),
            Column("lower", None, ends[0]),
            Column("upper", None, ends[1]),
            Column("verdict", None, verdicts),
            Column("unit", None, [parameter.unit for _, parameter in rows]),
        ]

    def test_columns(self) -> Table:
        """A row for each test; `specimen_factor` is the stress of a fitted specimen over that of the material."""
        every, factors = self.comparisons, self.specimen_factors
        return [
            Column("test", None, [comparison.test.name for comparison in every]),
            Column("used", None, ["fitted" if comparison.fitted else "validated" for comparison in every]),
            Column("points", None, np.array([comparison.test.measured.size for comparison in every])),
            Column("rms_error", None, np.array([comparison.rms_error for comparison in every])),
            Column("rms_relative_error", "1", np.array([comparison.rms_relative_error for comparison in every])),
            Column("r_squared", "1", np.array([comparison.r_squared for comparison in every])),
            Column("coverage", "1", np.array([comparison.coverage for comparison in every])),
            Column("specimen", None, [comparison.test.specimen for comparison in every]),
            Column("unit", None, [comparison.test.unit for comparison in every]),
            Column("specimen_factor", "1", np.array([factors.get(comparison.test.specimen, np.nan) for comparison in every])),
            Column("rms_voltage_error", "1", np.array([comparison.rms_voltage_error for comparison in every])),
            Column("slack_points", "1", np.array([np.count_nonzero(comparison.slack) for comparison in every])),
            Column("left_out_points", "1", np.array([comparison.test.unused.shape[1] for comparison in every])),
        ]

    def correlation_columns(self) -> Table:
        """Correlations between the parameters, from the draws if there are any: a row for each parameter."""
        names = list(self.fit.space.names)
        matrix = self.likelihood.correlation
        if self.draws.shape[0] > 2:
            with np.errstate(invalid="ignore", divide="ignore"):
                matrix = np.atleast_2d(np.corrcoef(self.draws.T))
        return [
            Column("parameter", None, names),
            *(Column(name, "1", column) for name, column in zip(names, matrix.T, strict=True)),
        ]

    def residual_columns(self) -> Table:
        """A row for each point of all tests."""
        return joined([comparison.columns() for comparison in self.comparisons])

    def profile_columns(self) -> Table:
        """The profiles, a row for each point: the rise of the sum of squares above that of the fit."""
        pairs = list(zip(self.fit.space.parameters, self.profiles, strict=False))
        return [
            Column("parameter", None, [parameter.name for parameter, profile in pairs for _ in profile.coordinate]),
            Column(
                "value",
                None,
                np.concatenate([parameter.value(profile.coordinate) for parameter, profile in pairs] or [np.zeros(0)]),
            ),
            Column("rise", "1", np.concatenate([profile.rise for _, profile in pairs] or [np.zeros(0)])),
        ]


def range_of(fit: Fit) -> CalibratedRange:
    """The range of the tests of a fit; for simulated tests, the range of the fitted material in them."""
    reached, times, heat = [], [], []
    for test in fit.problem.laboratory.tests:
        if isinstance(test, MeasuredTest):
            reached.append((Mode(test.mode).value, test.largest_invariant))
        else:
            reached.append(test.reach(fit.material))
        times += test.time[test.time > 0][[0, -1]].tolist()
        heat.append(test.temperature)
    modes, invariants = zip(*reached, strict=True)
    return CalibratedRange(tuple(sorted(set(modes))), max(invariants), (min(times), max(times)), (min(heat), max(heat)))


def calibrate(
    tests: Sequence[Experiment],
    material: Material,
    free: Mapping[str, Free],
    *,
    validate: Sequence[Experiment] = (),
    starts: int = STARTS,
    specimen_scatter: float | None = None,
    intervals: Intervals = Intervals(),
    watch: Watch | None = None,
) -> Calibration:
    """Fit the `free` constants of a material, by their path in a material file, to `tests`, with the uncertainty of each constant.

    Tests to `validate` are only predicted. Tests that the material cannot follow are left out and named in the result. The
    fit begins at `starts` points; `specimen_scatter` is the relative standard deviation of stress between specimens, estimated by
    default. `watch` is called with the name of the task, its steps done, its greatest number of steps, and the relative rms misfit.

    Raises `InputError` for a constant that the material does not have, tests without enough points, and temperatures at which its
    shift law does not hold; `NumericsError` if no start can follow the tests. The method is weighted least squares, with
    profiles of the likelihood.
    """
    fewest_draws(intervals.level)  # refuses what is no probability
    fit = fit_material(material, tests, free, starts=starts, specimen_scatter=specimen_scatter, watch=watch)
    return assessed(fit, validate=validate, intervals=intervals, watch=watch)


def assessed(
    fit: Fit,
    *,
    validate: Sequence[Experiment] = (),
    intervals: Intervals = Intervals(),
    watch: Watch | None = None,
) -> Calibration:
    """The uncertainty of a fit, and the comparison with all tests; arguments as those of `calibrate`."""
    likelihood, misfit = likelihood_of(fit), fit.misfit
    report: Watch = watch or (lambda *progress: None)
    profiles: tuple[Profile, ...] = ()
    drawn = np.zeros((0, len(fit.space)))
    try:
        if fit.finished:
            report("profiles", 0, 1, misfit)
            profiles = tuple(map(possible_values, profiles_of(likelihood, intervals.level), fit.space.parameters))
            if intervals.draws:

                def moved(moves: int, done: int) -> None:
                    report(f"draws of chains of {moves} moves", done, intervals.draws, misfit)

                drawn = draw(likelihood, profiles, intervals.draws, seed=intervals.seed, watch=moved)
    except KeyboardInterrupt:
        fit = replace(fit, finished=False)
    stratum = strata_of(drawn[:, open_parameters(fit.space, profiles)])
    comparisons = compare_tests(fit, likelihood, drawn, stratum, validate, intervals.level)
    lost = tuple(comparison.test.name for comparison in comparisons if not comparison.followed)
    return Calibration(fit, likelihood, profiles, drawn, comparisons, intervals.level, (*fit.left_out, *lost))
