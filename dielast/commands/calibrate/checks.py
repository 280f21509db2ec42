"""Warnings of a calibration: what the tests do not determine, bounds, tests beyond those fitted, and unstable springs."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from dielast.base.errors import and_more, warn
from dielast.calibration.experiment import MeasuredTest
from dielast.calibration.fit import MANY, Fit
from dielast.calibration.parameters import Parameter
from dielast.calibration.profiles import Profile, Verdict
from dielast.calibration.result import Calibration, range_of
from dielast.calibration.scatter import USUAL_SCATTER
from dielast.material.use_checks import BEYOND_TESTS, LONGER, UNTESTED, is_untested
from dielast.mechanics.load import Mode

FAR = 3.0  # usual scatters of specimens: no such specimen is expected
MISSED = 0.25  # relative rms error: several times that of a model that describes a test


def warn_of_fit(result: Calibration) -> None:
    """Warn of parameters that the tests do not determine or that are at a bound, of extrapolation, and of several minima."""
    fit = result.fit
    expected = dict(zip(fit.space.names, np.diag(fit.space.precision) > 0, strict=True))
    for prior, spread in ((False, "spread over the whole range between the bounds"), (True, "follow the prior")):
        if names := [
            f"{parameter.name} (at {100 * result.level:g} % {known})" if (known := known_of(parameter, profile)) else parameter.name
            for parameter, profile in zip(fit.space.parameters, result.profiles, strict=False)
            if profile.verdict is Verdict.UNDETERMINED and expected[parameter.name] == prior and not parameter.of_test
        ]:
            verb = "is" if len(names) == 1 else "are"
            warn(f"{', '.join(names)} {verb} not determined by these tests: draws {spread}")
    warn_of_bounds(result)
    warn_of_contradictions(result)
    warn_of_tests_beyond(result)
    warn_of_runaway(result)
    warn_of_slack(result)
    if fit.finished and fit.same_share < MANY:
        median = float(np.median(fit.start_misfit))
        others = f"the median misfit is {median:.3g} times as large" if np.isfinite(median) else "many cannot follow the tests"
        warn(f"only {100 * fit.same_share:.0f} % of the starts end in the best fit, {others}: raise fit.starts")


def warn_of_bounds(result: Calibration) -> None:
    """Warn of parameters at a bound, and of those of which the tests give only a bound."""
    fit = result.fit
    if result.profiles and np.all(fit.at_bound):
        warn("every free parameter is at a bound: check the units and signs of the tests, and widen the bounds")
    lower, _ = fit.space.bounds
    for k, (parameter, profile) in enumerate(zip(fit.space.parameters, result.profiles, strict=False)):
        known = "" if profile.verdict is Verdict.UNDETERMINED else known_of(parameter, profile)
        if fit.at_bound[k]:
            side = 0 if fit.coordinates[k] <= lower[k] else 1
            within = f"; between its bounds it is {known}" if known else ""
            warn(f"{parameter.name} is at its {_bound(parameter, side)}{within}")
        elif known:
            side = 1 if profile.verdict is Verdict.LOWER else 0
            beyond = f"; its {_bound(parameter, side)} is not ruled out" if parameter.default_bounds[side] else ""
            warn(f"these tests give only a bound of {parameter.name}: {known}{beyond}")


def known_of(parameter: Parameter, profile: Profile) -> str:
    """The interval of a parameter that is not determined, in words; "" for other intervals."""
    lower, upper = (float(parameter.value(end)) for end in (profile.lower, profile.upper))
    if profile.verdict is Verdict.DETERMINED or np.isnan([lower, upper]).all():
        return ""
    if np.isnan(upper):
        return f"at least {_quantity(parameter, lower)}"
    return f"at most {_quantity(parameter, upper)}" if np.isnan(lower) else f"{lower:.4g} to {_quantity(parameter, upper)}"


def _bound(parameter: Parameter, side: int) -> str:
    """The lower (0) or upper (1) bound of a parameter, and where it comes from."""
    number, key = ((parameter.lower, "min"), (parameter.upper, "max"))[side]
    default = parameter.default_bounds[side]
    origin = f"by default {default}: state {key} or start" if default else f"the stated {key}"
    return f"{('lower', 'upper')[side]} bound of {_quantity(parameter, number)} ({origin})"


def _quantity(parameter: Parameter, value: float) -> str:
    return f"{value:.4g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")


def warn_of_contradictions(result: Calibration) -> None:
    """Warn of specimens whose factor is far beyond the usual or a larger stated scatter, and of fitted tests that are missed."""
    scatter = result.fit.scatter
    stated = not np.isfinite(scatter.specimens)
    usual = max(USUAL_SCATTER, scatter.specimen) if stated else USUAL_SCATTER
    far = {name: factor for name, factor in result.specimen_factors.items() if abs(factor - 1) > FAR * usual}
    if far:
        listed = ", ".join(f"{name} {factor:.3g}" for name, factor in far.items())
        warn(f"stress over that of the material, by specimen: {listed}: check unit, cross-section, temperature and mode")
    missed = [each for each in result.comparisons if each.fitted and each.followed and each.rms_relative_error > MISSED]
    if missed:
        listed = ", ".join(f"{each.test.name} by {100 * each.rms_relative_error:.0f} %" for each in missed)
        warn(f"the material misses fitted tests, {listed}: they contradict each other, or the model cannot describe them")


def warn_of_tests_beyond(result: Calibration) -> None:
    """Warn of predicted tests that are longer, at larger stretches or in another mode than all fitted tests: extrapolations."""
    known = range_of(result.fit)
    measured = [each.test for each in result.comparisons if not each.fitted and isinstance(each.test, MeasuredTest)]
    late = [test for test in measured if test.time[-1] > LONGER * known.time[1]]
    if late:
        last, longest = max(test.time[-1] for test in late), known.time[1]
        lasting = f"lasts {last:.4g} s, the fitted tests at most {longest:.4g} s"
        warn(f"test {late[0].name}{and_more(len(late) - 1)} {lasting}: slower relaxation is unknown")
    far = [test for test in measured if test.largest_invariant > known.largest_invariant * (1 + BEYOND_TESTS)]
    if far:
        reach = f"reaches I1 = {max(test.largest_invariant for test in far):.4g}, the fitted tests {known.largest_invariant:.4g}"
        warn(f"test {far[0].name}{and_more(len(far) - 1)} {reach}: the springs are extrapolated")
    tested = 3 + UNTESTED * (known.largest_invariant - 3)
    other = [test for test in measured if is_untested(Mode(test.mode).value, known.modes) and test.largest_invariant > tested]
    if other:
        modes = f"is in {Mode(other[0].mode).value} loading, the fitted tests in {' and '.join(known.modes)} loading only"
        warn(f"test {other[0].name}{and_more(len(other) - 1)} {modes}: the springs are extrapolated")


def warn_of_runaway(result: Calibration) -> None:
    """Warn of tests under voltage in which the fitted material, or more draws than intervals leave out, run away."""
    for each in result.comparisons:
        if each.runaway is not None:
            unstable = f"the material is not stable in test {each.test.name} beyond a stretch of {each.runaway:.4g}"
            warn(f"{unstable}: it pulls in and becomes wider than it is long, and has no stress from there on")
        if each.opened is not None:
            runs = f"{100 * float(np.max(each.lost)):.0f} % of the draws run away in test {each.test.name}"
            share = f"more than {50 * (1 - result.level):.3g} % have"
            warn(f"{runs}: from a stretch of {each.opened:.4g} on, where {share}, its interval has no lower end")


def warn_of_slack(result: Calibration) -> None:
    """Name the tests in which specimens are slack, and up to which stretch."""
    listed = [
        f"{each.test.name} up to a stretch of {float(np.max(each.test.stretch[each.slack])):.4g} "
        f"({np.count_nonzero(each.slack)} of {each.slack.size} points)"
        for each in result.comparisons
        if each.slack.any() and each.test.stretch is not None
    ]
    if listed:
        pushed = 'where grips press a specimen, state slack = "pushes"'
        warn(f"specimens go slack when they are unloaded, and bear nothing: {', '.join(listed)}; {pushed}")


def warn_of_few_points(fits: Sequence[Fit]) -> None:
    """Warn of laws, the best first, that were fitted to a single test with too few independent points to weigh them."""
    best = fits[0]
    if len(fits) > 1 and len(best.problem.laboratory.tests) == 1 and not all(np.isfinite(fit.aicc) for fit in fits):
        most = max(len(fit.space) for fit in fits)
        few = (
            f"a single test with about {best.independent_points:.2g} independent points cannot weigh laws of up to {most} constants"
        )
        warn(
            f"{few}: material.toml has the law of fewest constants that it does not contradict; add tests at other rates and modes"
        )


def warn_of_laws_alike(weights: Mapping[str, float], volts: Sequence[float], written: Collection[str]) -> None:
    """Warn of laws with these weights, by name, that the tests cannot tell apart, and of how far apart they are: the voltages of a
    film, NaN where they are not known. The files `written` may hold draws, and further tests.
    """
    names = ", ".join(f"{name} ({100 * weight:.0f} %)" for name, weight in weights.items())
    apart = ""
    if np.all(np.array(volts) > 0):
        apart = f"; the voltage of a film differs by a factor of {max(volts) / min(volts):.3g} between them"
    drawn = ": draws are of each of them" if "draws.csv" in written else ": [uncertainty] draws would be of each of them"
    further = ", next_tests.csv lists tests that would" if "next_tests.csv" in written else ""
    warn(f"these tests cannot tell {names} apart{apart}{drawn}{further}")
