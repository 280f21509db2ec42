"""Draws of films and materials, also of several laws and of the next specimen, and the intervals they tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from films import SOFT
from hypothesis import given, strategies as st
from scipy.stats import genhyperbolic, norm, t as student

from dielast import DielastWarning, Free, Gent, MeasuredTest, MooneyRivlin, NeoHookean, Ogden, Yeoh
from dielast.base.errors import InputError
from dielast.calibration.fit import fit_material
from dielast.calibration.laws import mixed_draws
from dielast.calibration.likelihood import likelihood_of
from dielast.calibration.result import Calibration
from dielast.cli.run import compute
from dielast.commands.calibrate.checks import warn_of_laws_alike
from dielast.commands.calibrate.recipe import FreeValue
from dielast.commands.calibrate.task import free_of
from dielast.commands.registry import read_cases
from dielast.commands.simulation.bounds import bounded, warn_of_lives_outside
from dielast.commands.simulation.result import CaseResult
from dielast.handover.material_draws import draw_columns, parse_draws
from dielast.handover.material_file import write_material
from dielast.io.files import Inputs
from dielast.io.table import number_columns, to_csv
from dielast.material.breakdown import Breakdown
from dielast.material.intervals import DrawIntervals, fewest_draws, interval
from dielast.material.material import Material, numbers_of
from dielast.material.scatter import (
    WIDEST,
    FilmScatter,
    NormalScatter,
    SpecimenScatter,
    WeibullScatter,
    draw_sample,
)
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.sharing.execution import Execution

MEMBERS = tuple(Material(str(k), 1e4 + k, Spectrum(np.array([1.0]), np.array([1e4])), NoShift(20.0)) for k in range(5))
EVEN = (np.arange(20_000) + 0.5) / 20_000


def test_the_first_draws_are_the_members_and_more_repeat_some() -> None:
    few, many = draw_sample(MEMBERS, 3), draw_sample(MEMBERS, 200)
    assert few.materials == MEMBERS[:3]
    assert many.materials[:5] == MEMBERS
    assert set(many.materials[5:]) == set(MEMBERS)
    assert np.all(many.breakdown_factor == 1)
    assert np.all(many.thickness_factor == 1)
    scattering = replace(MEMBERS[1], breakdown=Breakdown((), (4e7,), relative=0.05))
    of_some = draw_sample((MEMBERS[0], scattering), 20)
    assert np.array_equal(of_some.breakdown_factor != 1, [material is scattering for material in of_some.materials])


def test_a_draw_depends_on_the_seed_and_its_number_alone() -> None:
    field, thickness = WeibullScatter(20.0), NormalScatter(0.02)
    one = draw_sample(MEMBERS, 40, seed=7, scatter=FilmScatter(breakdown_field=field, thickness=thickness))
    more = draw_sample(MEMBERS, 90, seed=7, scatter=FilmScatter(breakdown_field=field, thickness=thickness))
    alone = draw_sample(MEMBERS, 40, seed=7, scatter=FilmScatter(thickness=thickness))
    assert more.materials[:40] == one.materials
    assert np.array_equal(more.breakdown_factor[:40], one.breakdown_factor)
    assert np.array_equal(alone.thickness_factor, one.thickness_factor)
    other = draw_sample(MEMBERS, 40, seed=8, scatter=FilmScatter(thickness=thickness))
    assert not np.any(other.thickness_factor == one.thickness_factor)


def test_scatter_has_the_distribution_it_is_called_after() -> None:
    normal, weibull = NormalScatter(0.05).factors(EVEN), WeibullScatter(12.0).factors(EVEN)
    assert np.mean(normal) == pytest.approx(1.0, abs=1e-4)
    assert np.std(normal) == pytest.approx(0.05, rel=1e-3)
    assert np.mean(weibull <= 1.0) == pytest.approx(1 - np.exp(-1), abs=1e-4)
    assert np.median(weibull) == pytest.approx(np.log(2) ** (1 / 12), rel=1e-4)
    assert np.all(NormalScatter(0.9).factors(EVEN) > 0)
    assert np.all(NormalScatter(0.0).factors(EVEN) == 1)


@pytest.mark.parametrize(("level", "fewest"), [(0.9, 19), (0.95, 39), (0.5, 3), (0.99, 199)])
def test_the_fewest_draws_are_just_enough(level: float, fewest: int) -> None:
    assert fewest_draws(level) == fewest
    values = np.random.default_rng(1).standard_normal(fewest)
    low, high = interval(values, level)
    assert (low, high) == (values.min(), values.max())
    assert np.all(np.isnan(interval(values[1:], level)))


def test_what_has_not_happened_is_later_than_all_that_has() -> None:
    values = np.arange(19.0)
    values[7:9] = np.inf
    low, high = interval(values, 0.9)
    assert (low, high) == (0.0, np.inf)
    low, high = interval(np.concatenate((np.full(40, np.inf), [1.0])), 0.9)
    assert low == high == np.inf


BASE = Material("film", 2e4, Spectrum([100.0, 3.0], [2e4, 4e4]), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=4e-11)


def test_draws_keep_their_laws() -> None:
    draws = [
        replace(BASE, equilibrium_law=Gent(80.0)),
        replace(BASE, equilibrium_law=MooneyRivlin(8e3, 2e3), nonequilibrium_law=NeoHookean()),
        replace(BASE, equilibrium_law=Gent(120.0), equilibrium_modulus=3e4),
        replace(BASE, equilibrium_law=Yeoh(1e4, -20.0, 1.0), nonequilibrium_law=Yeoh(0.5, 0.01, 0.0)),
        replace(BASE, equilibrium_law=Ogden((1.5e4, 2e3), (1.8, 3.0)), equilibrium_modulus=16.5e3),
    ]
    content = to_csv(draw_columns(np.arange(len(draws)), draws))
    for draw, found in zip(draws, parse_draws(content, "draws.csv", BASE), strict=True):
        assert type(found.equilibrium_law) is type(draw.equilibrium_law)
        assert type(found.nonequilibrium_law) is type(draw.nonequilibrium_law)
        stated, kept = numbers_of(draw), numbers_of(found)
        for section in ("equilibrium", "nonequilibrium"):
            for key, value in stated[section].items():
                assert np.allclose(kept[section][key], value), (section, key)


@pytest.mark.parametrize(
    ("row", "cell", "wrong"),
    [
        (3, "mooney-rivlin", "mooney-rivlyn"),
        (4, "120", "-120"),
        (4, "120", "many"),
        (2, "80", "many"),
        (4, "30000", "-30000"),
    ],
)
def test_a_mistake_in_a_draw_is_named_by_its_row(row: int, cell: str, wrong: str) -> None:
    draws = [
        replace(BASE, equilibrium_law=Gent(80.0)),
        replace(BASE, equilibrium_law=MooneyRivlin(8e3, 2e3)),
        replace(BASE, equilibrium_law=Gent(120.0), equilibrium_modulus=3e4),
    ]
    lines = to_csv(draw_columns(np.arange(len(draws)), draws)).decode().splitlines()
    assert f",{cell}," in lines[row - 1] + ","
    lines[row - 1] = (lines[row - 1] + ",").replace(f",{cell},", f",{wrong},")[:-1]
    with pytest.raises(InputError) as caught:
        parse_draws("\n".join(lines).encode(), "draws.csv", BASE)
    assert [(problem.file, problem.row) for problem in caught.value.problems] == [("draws.csv", row)]


def solid(law: Any, modulus: float) -> Material:
    return Material("m", modulus, Spectrum([], []), NoShift(20.0), law)


def test_an_interval_of_several_laws_holds_that_of_each() -> None:
    random = np.random.default_rng(3)
    values, laws = random.standard_normal((400, 2)), np.repeat([0, 1, 2, 3], [230, 150, 19, 1])
    values[laws == 1] += 7
    values[laws == 3] = [-50.0, 1.0]
    low, high = interval(values, 0.9, laws)
    parts = [interval(values[laws == law], 0.9) for law in range(3)]
    assert low == pytest.approx([-50.0, min(part[0][1] for part in parts)])
    assert high == pytest.approx(np.max([part[1] for part in parts], axis=0))
    assert interval(values, 0.9, np.zeros(400, dtype=int))[0] == pytest.approx(interval(values, 0.9)[0])
    assert DrawIntervals(0.9, laws, 0.95).assured(values[:, 1]) == low[1]
    # too few draws in all have no interval, as with one law; an event that one law never has has no end
    assert np.isnan(interval(values[:18, 0], 0.9, laws[:18])[0])
    times = np.where(laws == 1, np.inf, np.exp(values[:, 1]))
    assert interval(times, 0.9, laws)[1] == np.inf


def test_draws_of_several_laws_take_turns() -> None:
    parts = [tuple(solid(law, 1e4 + k) for k in range(200)) for law in (Gent(50.0), NeoHookean(), Gent(70.0))]
    results: Any = [SimpleNamespace(materials=part) for part in parts]
    members = mixed_draws(results, [0.6, 0.3, 0.1])
    assert len(members) == 200
    for count in (20, 100, 200):
        shares = [np.mean([member in part for member in members[:count]]) for part in parts]
        assert shares == pytest.approx([0.6, 0.3, 0.1], abs=1 / count)
    laws = draw_sample(members, 30).laws
    assert laws is not None
    assert np.bincount(laws).tolist() == [21, 9]  # two laws: the constants do not count
    assert draw_sample(parts[0], 30).laws is None


def test_a_spring_of_which_nothing_is_free_is_named() -> None:
    free: Any = {"equilibrium.shear_modulus": FreeValue(), "nonequilibrium.shear_modulus": FreeValue()}
    branches = Spectrum(np.array([10.0]), np.array([1e4]))
    materials = {
        name: Material("m", 1e4, branches, NoShift(20.0), law, law)
        for name, law in (("gent.toml", Gent(50.0)), ("mooney.toml", MooneyRivlin(4e3, 1e3)))
    }
    with pytest.warns(DielastWarning, match=r"\[equilibrium\] of mooney.toml is free, .* equilibrium.C10, equilibrium.C01"):
        found = free_of(free, materials, Inputs(Path()))
    assert set(found["mooney.toml"]) == {"nonequilibrium.shear_modulus"}


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ({}, r"1.5 between them: \[uncertainty\] draws would be of each of them$"),
        ({"draws.csv": 0}, "draws are of each of them$"),
        ({"draws.csv": 0, "next_tests.csv": 0}, "draws are of each of them, next_tests.csv lists tests that would$"),
    ],
)
def test_laws_that_cannot_be_told_apart_name_only_files_that_are_there(written: dict[str, int], words: str) -> None:
    with pytest.warns(DielastWarning, match=words):
        warn_of_laws_alike({"gent": 0.6, "yeoh": 0.4}, [2e3, 3e3], written)


MODULUS, SCATTER, ERROR = 4e4, 0.06, 0.03
START = Material("m", 5e4, Spectrum([], []), NoShift(20.0), NeoHookean(), NeoHookean())
STRETCH = np.linspace(1.1, 2.5, 12)
DISTANCE = np.sqrt(3) * np.abs(np.log(STRETCH)[:, None] - np.log(STRETCH)) / 0.3
ALONG = np.linalg.cholesky((1 + DISTANCE) * np.exp(-DISTANCE) + 1e-9 * np.eye(STRETCH.size))


def stress(random: np.random.Generator) -> np.ndarray:
    """Nominal stresses of a specimen of its own modulus, with an error of the model along the curve, and noise."""
    wave = ALONG @ random.standard_normal(STRETCH.size)
    off = np.exp(SCATTER * random.standard_normal()) * (1 + ERROR * wave + 0.003 * random.standard_normal(12))
    return MODULUS * (STRETCH - STRETCH**-2) * off


@pytest.mark.parametrize(("laboratories", "bounds"), [(4, (0.8, 0.97)), pytest.param(60, (0.84, 0.95), marks=pytest.mark.trust)])
def test_bands_hold_the_next_specimen(laboratories: int, bounds: tuple[float, float]) -> None:
    held, narrow = [], []
    for laboratory in range(laboratories):
        random = np.random.default_rng([laboratory, 70])
        tests = [MeasuredTest(f"pull {k}", np.arange(1.0, 13.0), STRETCH, stress(random), 20.0) for k in range(5)]
        fit = fit_material(START, tests, {"equilibrium.shear_modulus": Free()}, starts=1)
        found = likelihood_of(fit)
        known = Calibration(fit, found, (), np.zeros((0, 1)), ()).material
        own = known.equilibrium_modulus * np.exp(found.standard_error[0] * random.standard_normal(100))
        members = [replace(known, equilibrium_modulus=modulus) for modulus in own.tolist()]
        further = np.array([stress(random) for _ in range(40)]) / (STRETCH - STRETCH**-2)
        for coverage, sample in ((held, draw_sample(members, 400)), (narrow, draw_sample(members, 100, specimens=False))):
            low, high = interval(np.array([member.equilibrium_modulus for member in sample.specimens()]), 0.9)
            coverage.append(np.mean((further >= low) & (further <= high)))
    assert bounds[0] < np.mean(held) < bounds[1]
    assert np.mean(narrow) < 0.6


@pytest.mark.parametrize(("relative", "freedom"), [(0.06, 2.0), (0.1, 6.0), (0.5, 3.0), (0.06, 300.0)])
def test_the_scatter_of_specimens_is_generalised_hyperbolic(relative: float, freedom: float) -> None:
    """Its tail is bounded where Student's is not: with 2 degrees of freedom, one of 10,000 is 2.5 times as stiff, not 55 times."""
    quantile = np.array([0.02, 0.3, 0.75, 0.95, 0.9975, 0.9999])
    delta, steep = relative * np.sqrt(freedom), 1 / WIDEST
    expected = genhyperbolic.ppf(quantile, -freedom / 2, steep * delta, 0.0, 0.0, delta) / relative
    assert SpecimenScatter(relative, freedom).deviates(quantile) == pytest.approx(expected, rel=2e-4)


def test_the_scatter_of_specimens_is_students_where_the_prior_says_nothing() -> None:
    quantile = np.array([0.05, 0.6, 0.9, 0.99])
    for freedom in (3.0, 12.0, 1e4):
        assert SpecimenScatter(1e-4, freedom).deviates(quantile) == pytest.approx(student.ppf(quantile, freedom), rel=2e-4)
    assert SpecimenScatter(0.05).deviates(quantile) == pytest.approx(norm.ppf(quantile), rel=1e-9)


RELAX = 'kind = "relax"\nmaterial = "m.toml"\n[[step]]\nstretch = 1.5\nrate = "5 %/s"\n[output]\npoints_per_decade = 2\n'
HEAD = 'reference_temperature = "20 degC"\ndraws = "draws.csv"\nequilibrium = { shear_modulus = "26 kPa" }\n'


def run(folder: Path, recipe: str) -> dict[str, bytes]:
    path = folder / "r.toml"
    path.write_text(recipe)
    return compute("relax", read_cases(path), path, (), Execution())[0]


def test_draws_of_an_elastic_material(tmp_path: Path) -> None:
    branches = 'nonequilibrium = { relaxation_time_s = [], shear_modulus_Pa = [] }\nshift = { law = "none" }\n'
    (tmp_path / "m.toml").write_text(HEAD + branches)
    rows = "".join(f"{k},{26000 + 10 * k}\n" for k in range(-12, 12))
    (tmp_path / "draws.csv").write_text("draw,equilibrium_shear_modulus [Pa]\n" + rows.replace("-", "1"))
    files = run(tmp_path, RELAX + "[uncertainty]\n")
    assert b"nominal_stress_1_upper [Pa]" in files["relax.csv"]


def test_an_error_of_a_draw_names_the_case(tmp_path: Path) -> None:
    """At -170 degC, below the pole of one draw's shift law but not of the material's."""
    branches = "nonequilibrium = { relaxation_time_s = [10.0], shear_modulus_Pa = [1e4] }\n"
    (tmp_path / "m.toml").write_text(HEAD + branches + 'shift = { law = "wlf", C1 = 13.7, C2 = "200 K" }\n')
    header = "draw,equilibrium_shear_modulus [Pa],C1 [1],C2 [K],shear_modulus_1 [Pa],relaxation_time_1 [s]\n"
    rows = "".join(f"{k},26000,13.7,{180 if k == 17 else 200},1e4,10\n" for k in range(24))
    (tmp_path / "draws.csv").write_text(header + rows)
    with pytest.raises(InputError) as caught:
        run(tmp_path, RELAX + '[uncertainty]\n[sweep]\ntemperature = ["20 degC", "0 degC", "-170 degC"]\n')
    (line,) = caught.value.messages
    assert line.startswith(f"{tmp_path / 'r.toml'}: case 2: uncertainty: in a draw: temperature: -170 degC")


TIME = np.linspace(0.0, 9.0, 10)


def film(rate: float, rows: int) -> CaseResult:
    """A film that grows at this rate, and of which so many rows are known."""
    time = TIME[:rows]
    columns = {"time [s]": time, "stretch_1 [1]": 1 + rate * time, "stability [1]": 1 - rate * time}
    return CaseResult(20.0, {**columns, "nominal_stress_1 [Pa]": np.full(rows, 1e4)}, None)


def test_a_film_that_has_failed_is_beyond_every_upper_bound() -> None:
    """Of 39 films, the faster one grows the earlier it fails, two at a time."""
    rates = np.linspace(0.09, 0.01, 39)
    ends = np.minimum(2 + np.arange(39) // 2, 10)
    drawn = [film(rate, rows) for rate, rows in zip(rates.tolist(), ends.tolist(), strict=True)]
    central = film(0.05, 10)
    columns = bounded(central, drawn, DrawIntervals(0.9), [True] * 39).columns
    low, high, share = (columns[name] for name in ("stretch_1_lower [1]", "stretch_1_upper [1]", "surviving [1]"))
    lost = np.array([np.sum(ends <= row) for row in range(10)])
    assert share == pytest.approx(1 - lost / 39)
    # the second of 39 from either end bounds 90 %: with two failed there is no upper bound
    assert np.array_equal(np.isfinite(high), lost < 2)
    assert high[:2] == pytest.approx(1 + rates[1] * TIME[:2])
    # the slowest survive them all: their bound is that of all films
    assert low == pytest.approx(1 + rates[37] * TIME)
    # what runs down to the failure is bounded from above to the end, by those that survive the longest
    low, high = columns["stability_lower [1]"], columns["stability_upper [1]"]
    assert np.array_equal(np.isfinite(low), lost < 2)
    assert high == pytest.approx(1 - rates[37] * TIME)


def test_the_interval_of_films_of_which_some_fail_holds_its_own_curve(tmp_path: Path) -> None:
    """Thin films fail first: those that survive grow less than the film that is drawn, and bounded it from below."""
    (tmp_path / "m.toml").write_bytes(write_material(SOFT))
    path = tmp_path / "r.toml"
    path.write_text(
        """
kind = "actuate"
material = "m.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.5
[[step]]
voltage = "6 kV"
[[step]]
hold = "1 h"
[breakdown]
field = "50 MV/m"
[output]
points_per_decade = 5
[uncertainty]
draws = 60
thickness = "5 %"
"""
    )
    content = compute("actuate", read_cases(path), path, (), Execution())[0]["actuate.csv"]
    names = ["relative_stretch_1 [1]", "relative_stretch_1_lower [1]", "relative_stretch_1_upper [1]", "surviving [1]"]
    own, low, high, surviving = number_columns(content, "actuate.csv", names)
    assert surviving[-1] < 0.9
    assert np.all(low[surviving >= 0.1] <= own[surviving >= 0.1])
    there = ~np.isnan(high)
    assert np.all(own[there] <= high[there])
    # the bound of 95 % of the films ends with the film that is the 58th of 60
    assert np.array_equal(there, surviving > 57.5 / 60)


def test_lives_outside_their_intervals_are_counted() -> None:
    """A best fit need not be in the middle of its draws; a film that survives lives longer than the horizon."""
    lives, modes = np.array([[[1.0, 5.0, np.nan, np.nan, np.nan]]]), np.array([[["breakdown"] * 2 + ["none"] * 2 + ["unfinished"]]])
    cells: Any = SimpleNamespace(time_to_failure=lives, failure_mode=modes)
    low, high = np.array([[[2.0, 2.0, 2.0, 2.0, 2.0]]]), np.array([[[9.0, 9.0, 9.0, np.inf, 9.0]]])
    with pytest.warns(DielastWarning, match=r"^2 of 5 cells: the time to failure of the stated material is outside"):
        warn_of_lives_outside(cells, (low, high))


@pytest.mark.parametrize("make", [lambda: NormalScatter(1.0), lambda: NormalScatter(-0.1), lambda: WeibullScatter(0.0)])
def test_scatter_that_makes_no_sense_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(InputError, match=r"must be|is needed"):
        make()


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(InputError, match="at least one"):
        draw_sample((), 10)


def test_a_scaled_breakdown_field_keeps_its_prestretches() -> None:
    assert Breakdown((1.7, 1.9), (40e6, 48e6)).scaled(0.5) == Breakdown((1.7, 1.9), (20e6, 24e6))


@given(st.lists(st.floats(-1e6, 1e6), min_size=19, max_size=80), st.integers(0, 30))
def test_what_is_no_draw_does_not_count(values: list[float], missing: int) -> None:
    alone = interval(np.array(values), 0.9)
    padded = interval(np.array(values + [np.nan] * missing), 0.9)
    assert alone == padded
    assert min(values) <= alone[0] <= alone[1] <= max(values)
