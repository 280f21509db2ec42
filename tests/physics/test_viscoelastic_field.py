"""A nominal field on the membrane: closed forms of the elastic film, both forms of the equations, and the way through a runaway."""

from __future__ import annotations

import numpy as np
import pytest
from films import Followed, followed

from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.line import Line
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control

MU, PERMITTIVITY = 26e3, 3.98e-11
FREE = (Control.STRESS, Control.STRESS)


def film(limit: float, tau: tuple[float, ...] = (1e-2,), modulus: tuple[float, ...] = (0.0,)) -> PointMaterial:
    solid = Material("film", MU, Spectrum(tau, modulus), NoShift(20.0), Gent(limit), Gent(55.0), permittivity=PERMITTIVITY)
    return PointMaterial.of(solid, np.array([20.0]), 1e-8)


def charge(
    points: PointMaterial, field: float, stress: float, ramp: float, hold: float, controls: tuple[Control, Control] = FREE
) -> Followed:
    """Dead load at once, then the field within `ramp`, then a hold; all targets equal in both axes."""
    pull = np.array([stress])
    pieces = [
        Line.to(controls, (pull, pull, None), np.zeros(1)),
        Line.to(controls, (pull, pull, np.array([field])), np.array([ramp])),
        Line.to(controls, (None, None, None), np.array([hold])),
    ]
    return followed(points, pieces, rtol=1e-8)


@pytest.mark.parametrize("stress", [0.0, 1e4])
@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
def test_elastic_film_below_pull_in_follows_the_closed_form(stress: float, share: float) -> None:
    stretches = np.linspace(1.0, 2.5, 200001)
    squared_field = (MU * (stretches**-2 - stretches**-8) - stress * stretches**-3) / PERMITTIVITY
    field = np.sqrt(squared_field.max()) * share
    record = charge(film(float("inf")), field, stress, 1.0, 1.0)
    assert record.outcome[0].completed
    stretch = np.exp(0.5 * record.log_squared_stretch[0, 0, -1])
    balance = MU * (stretch**-2 - stretch**-8) - stress * stretch**-3
    assert PERMITTIVITY * field**2 == pytest.approx(balance, rel=1e-7)


def test_elastic_film_ends_at_pull_in() -> None:
    """No equilibrium beyond V/L_3 = 0.687365 sqrt(mu/eps): the elastic film's path ends there and the outcome says so."""
    critical = 0.687365 * np.sqrt(MU / PERMITTIVITY)
    record = charge(film(float("inf")), 1.1 * critical, 0.0, 11.0, 1.0)
    assert not record.outcome[0].completed
    assert record.outcome[0].time == pytest.approx(10.0, rel=1e-5)


def test_the_viscoelastic_film_runs_through_to_the_state_that_stiffening_holds() -> None:
    field = 0.9 * np.sqrt(MU / PERMITTIVITY)
    # as in VHB 4905, the glassy branch outweighs any field on the way: with less, the frozen film would lose its equilibrium
    record = charge(film(110.0, (1e-7, 10.0), (2.3e8, 1e5)), field, 0.0, 1.0, 1e5)
    assert record.outcome[0].completed
    stretch = np.exp(0.5 * record.log_squared_stretch[0, 0, -1])
    assert stretch > 3
    stiffness = 1 / (1 - (2 * stretch**2 + stretch**-4 - 3) / 110)
    assert MU * stiffness * (stretch**-2 - stretch**-8) == pytest.approx(PERMITTIVITY * field**2, rel=1e-6)


def test_biaxial_and_equibiaxial_equations_agree_under_a_field() -> None:
    points, field, stress = film(110.0, (1e-3, 10.0), (1e7, 1e5)), 0.5 * np.sqrt(MU / PERMITTIVITY), np.array([1e4])
    symmetric = charge(points, field, 1e4, 1.0, 100.0)
    pieces = [
        Line.to(FREE, (stress, stress, None), np.zeros(1)),
        Line.to(FREE, (stress, stress, np.array([field])), np.array([1.0])),
        Line.to(FREE, (None, None, None), np.array([100.0])),
        Line.to((Control.STRETCH, Control.STRESS), (None, None, None), np.array([1.0])),
    ]
    full = followed(points, pieces, rtol=1e-8)
    columns = symmetric.time.shape[1]
    assert full.log_squared_stretch[0, 0, :columns] == pytest.approx(symmetric.log_squared_stretch[0, 0], rel=1e-6, abs=3e-8)
    assert full.log_squared_stretch[1, 0, :columns] == pytest.approx(full.log_squared_stretch[0, 0, :columns], abs=1e-10)


def test_a_clamped_film_stays_put_and_loses_tension() -> None:
    points, stretch = film(110.0, (10.0,), (1e5,)), np.array([1.5])
    clamped = (Control.STRETCH, Control.STRETCH)
    pieces = [
        Line.to(clamped, (stretch, stretch, None), np.zeros(1)),
        Line.to(clamped, (None, None, None), np.array([1e3])),
        Line.to(clamped, (None, None, np.array([2e7])), np.array([1.0])),
    ]
    record = followed(points, pieces, rtol=1e-8)
    assert np.exp(0.5 * record.log_squared_stretch[:, 0, -1]) == pytest.approx(1.5, rel=1e-12)
    maxwell = PERMITTIVITY * 2e7**2 * 1.5**4
    elastic = MU * (1.5**2 - 1.5**-4) / (1 - (2 * 1.5**2 + 1.5**-4 - 3) / 110)
    assert record.nominal_stress[0, 0, -1] == pytest.approx((elastic - maxwell) / 1.5, rel=1e-6)


def test_a_case_that_ends_early_leaves_the_others_whole() -> None:
    solid = Material("film", MU, Spectrum([1.0], [1e5]), NoShift(20.0), Gent(), Gent(), permittivity=PERMITTIVITY)
    points, critical = PointMaterial.of(solid, np.full(3, 20.0), 1e-8), 0.687365 * np.sqrt(MU / PERMITTIVITY)
    none, fields = np.zeros(3), critical * np.array([0.5, 1.5, 0.9])
    pieces = [Line.to(FREE, (none, none, fields), np.ones(3)), Line.to(FREE, (None, None, None), np.full(3, 100.0))]
    together = followed(points, pieces, rtol=1e-8)
    assert [outcome.completed for outcome in together.outcome] == [True, False, True]
    ended = together.outcome[1]
    assert ended.reason == "the rates grow beyond all bounds"
    late = together.time[1] > ended.time
    assert late.any()
    assert np.isnan(together.log_squared_stretch[:, 1, late]).all()
    assert np.isfinite(together.log_squared_stretch[:, 1, ~late]).all()
    survivors = [0, 2]
    alone = followed(
        points.take(np.array(survivors)),
        [Line.to(FREE, (none[:2], none[:2], fields[survivors]), np.ones(2)), Line.to(FREE, (None, None, None), np.full(2, 100.0))],
        rtol=1e-8,
    )
    assert np.array_equal(alone.log_squared_stretch[:, :, -1], together.log_squared_stretch[:, survivors, -1])
