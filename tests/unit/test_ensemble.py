"""Draws of films and the intervals they tell."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import InputError
from dielast.material.material import Breakdown, Material
from dielast.material.scatter import FilmScatter, NormalScatter, WeibullScatter, draw_sample, fewest_draws, interval
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum

MEMBERS = tuple(Material(str(k), 1e4 + k, Spectrum(np.array([1.0]), np.array([1e4])), NoShift(20.0)) for k in range(5))
EVEN = (np.arange(20_000) + 0.5) / 20_000


def test_the_first_draws_are_the_members_and_more_repeat_some() -> None:
    few, many = draw_sample(MEMBERS, 3), draw_sample(MEMBERS, 200)
    assert few.materials == MEMBERS[:3]
    assert many.materials[:5] == MEMBERS
    assert set(many.materials[5:]) == set(MEMBERS)
    assert np.all(many.breakdown_factor == 1)
    assert np.all(many.thickness_factor == 1)


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


@pytest.mark.parametrize("make", [lambda: NormalScatter(1.0), lambda: NormalScatter(-0.1), lambda: WeibullScatter(0.0)])
def test_scatter_that_makes_no_sense_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(InputError, match=r"must be|is needed"):
        make()


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(InputError, match="at least one"):
        draw_sample((), 10)


def test_a_scaled_breakdown_field_keeps_its_prestretches() -> None:
    assert Breakdown((1.7, 1.9), (40e6, 48e6)).scaled(0.5) == Breakdown((1.7, 1.9), (20e6, 24e6))


@pytest.mark.parametrize(("level", "fewest"), [(0.9, 19), (0.95, 39), (0.5, 3), (0.99, 199)])
def test_the_fewest_draws_are_just_enough(level: float, fewest: int) -> None:
    assert fewest_draws(level) == fewest
    values = np.random.default_rng(1).standard_normal(fewest)
    low, high = interval(values, level)
    assert (low, high) == (values.min(), values.max())
    assert np.all(np.isnan(interval(values[1:], level)))


def test_an_interval_holds_one_more_draw_as_often_as_it_says() -> None:
    values = np.random.default_rng(3).exponential(size=(60, 20_000))
    low, high = interval(values[:-1], 0.8)
    assert np.mean((low <= values[-1]) & (values[-1] <= high)) == pytest.approx(0.8, abs=0.01)


def test_what_has_not_happened_is_later_than_all_that_has() -> None:
    values = np.arange(19.0)
    values[7:9] = np.inf
    low, high = interval(values, 0.9)
    assert (low, high) == (0.0, np.inf)
    low, high = interval(np.concatenate((np.full(40, np.inf), [1.0])), 0.9)
    assert low == high == np.inf


@given(st.lists(st.floats(-1e6, 1e6), min_size=19, max_size=80), st.integers(0, 30))
def test_what_is_no_draw_does_not_count(values: list[float], missing: int) -> None:
    alone = interval(np.array(values), 0.9)
    padded = interval(np.array(values + [np.nan] * missing), 0.9)
    assert alone == padded
    assert min(values) <= alone[0] <= alone[1] <= max(values)
