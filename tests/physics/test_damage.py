"""Damage that adds up under voltage: closed forms of films that do not creep, scipy's quadrature, the membrane peer, scatter."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import comb
from typing import Any

import numpy as np
import pytest
from flat import actuate, design, failure_map, plan_failure_map
from peers.closed_forms import damage_exponent
from peers.energies import gent
from peers.kept import Run
from peers.membrane import Film, Piece, constant, ramp
from scipy.integrate import quad

from dielast import (
    Breakdown,
    FilmScatter,
    Gent,
    InputError,
    Material,
    Sample,
    Spectrum,
    VoltageStep,
    Waveform,
    WeibullScatter,
    draw_sample,
)
from dielast.material.damage import InversePower
from dielast.material.sensitivity import Exchange
from dielast.material.shift import NoShift
from dielast.numerics.quadrature import FINE, _by_rule, integrals
from dielast.simulate.actuation_history import ActuationHistory
from dielast.simulate.events import Event
from dielast.simulate.failure_map import solve_map

MU, EPS, THICKNESS, HOUR = 26e3, 4e-11, 0.5e-3, 3600.0
MODULUS, TIME = np.array([3e4, 1e5, 3e6]), np.array([30.0, 1.0, 0.01])
GENT = Material("gent", MU, Spectrum(TIME, MODULUS), NoShift(20.0), Gent(110.0), Gent(55.0), EPS)
ELASTIC = Material("elastic", 1e6, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), permittivity=EPS)
SILICONE = replace(ELASTIC, damage=InversePower(80e6, HOUR, 18.5))
CLAMPED: dict[str, Any] = {"thickness": THICKNESS, "prestretch": 1.7, "boundary": "clamped"}
UP, HOLD, VOLTAGE = 0.5, 8.0, 3.9e3
PROGRAMME = [VoltageStep(VOLTAGE, duration=UP), VoltageStep.hold(HOLD)]


def damaged(history: ActuationHistory, case: int = 0) -> Event:
    (event,) = [event for event in history.events[case] if event.name == "damage"]
    return event


def test_life_is_an_inverse_power_of_the_voltage_where_a_film_does_not_creep() -> None:
    voltage = np.geomspace(8e3, 16e3, 25)
    result = failure_map(SILICONE, voltage=voltage, horizon=1e12, **CLAMPED)
    life = result.times["damage"][0, 0]
    assert life == pytest.approx(HOUR * (80e6 * THICKNESS / 1.7**2 / voltage) ** 18.5, rel=1e-9)
    assert np.all(result.failure_mode == "damage")
    # 62-fold from 80 to 100 V/um
    ratio = life[0] / np.interp(voltage[0] * 1.25, voltage, life)
    assert damage_exponent(ratio, 1.25) == pytest.approx(18.5, rel=1e-2)


def test_an_elastic_film_under_dead_load_ages_at_the_field_that_it_settles_at() -> None:
    history = actuate(SILICONE, [VoltageStep(13e3), VoltageStep.hold(1e9)], thickness=THICKNESS, prestretch=1.5, stop_at="damage")
    event = damaged(history)
    assert event.time == pytest.approx(HOUR * (80e6 / event.true_field) ** 18.5, rel=1e-6)


@pytest.mark.parametrize(
    ("exponent", "boundary"),
    [
        pytest.param(1.0, "dead-load", marks=pytest.mark.trust),
        pytest.param(200.0, "dead-load", marks=pytest.mark.trust),
        (18.5, ("dead-load", "clamped")),
    ],
)
def test_the_damage_is_the_integral_of_the_history(exponent: float, boundary: Any) -> None:
    """scipy's quadrature of the run's own field, up to the moment of failure, is 1."""
    programme = [VoltageStep(3.4e3, duration=UP), VoltageStep.hold(2.0), VoltageStep(0.0, duration=0.3)]
    programme.append(VoltageStep(Waveform(0.0, 3.6e3, 1.0, 2)))
    slow = replace(GENT, spectrum=Spectrum(TIME[:2], MODULUS[:2]))
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": (1.9, 1.6), "relax": 60.0, "boundary": boundary}
    whole = actuate(slow, programme, stop_at="end", **film)
    assert whole.outcome[0].completed
    field, time = whole.true_field[0], whole.time[0]
    law = InversePower(float(field.max()), 1.0, exponent)
    law = replace(law, time=0.9 * float(np.sum(np.diff(time) * (law.rate(field[1:]) + law.rate(field[:-1])) / 2)))
    material = replace(slow, damage=law)
    end = damaged(actuate(material, programme, stop_at="damage", **film)).time
    assert end > 3.0  # the waveform is on
    kinks = [0.0, UP, UP + 2.0, UP + 2.3, *np.arange(UP + 2.8, end, 0.5).tolist(), end]
    nodes, weights = np.polynomial.legendre.leggauss(12)
    # panels that grow away from each kink, as the rate rises and falls steeply on both sides of the peaks of a wave
    half = np.concatenate(([0.0], np.geomspace(1e-5, 0.5, 9)))
    edges = [a + (b - a) * np.concatenate((half, 1 - half[-2::-1])) for a, b in pairwise(kinks)]
    panels = [(low, high) for edge in edges for low, high in pairwise(edge)]
    times = np.concatenate([0.5 * (high + low) + 0.5 * (high - low) * nodes for low, high in panels])
    weight = np.concatenate([0.5 * (high - low) * weights for low, high in panels])
    history = actuate(slow, programme, stop_at="end", times=times, **film)
    field = np.abs(history.true_field[0])
    assert float(np.sum(weight * law.rate(field))) == pytest.approx(1.0, rel=1e-6)


def test_failure_by_damage_is_where_the_peer_has_it_and_converges_with_the_tolerance() -> None:
    prestretch, damage = (2.0, 1.6), (2.9e7, 2.0, 18.5)
    there = Film(lambda l1, l2: gent(l1, l2, MU, 110.0), lambda l1, l2: gent(l1, l2, 1.0, 55.0), MODULUS, TIME, EPS, damage=damage)
    relaxed = Run(there, [Piece(60.0, tuple(("stretch", constant(axis)) for axis in prestretch))], rtol=1e-7).final
    load, nominal = tuple(("stress", constant(stress)) for stress in relaxed.stress), VOLTAGE / THICKNESS
    pieces = [Piece(UP, load, ("field", ramp(0.0, nominal, UP))), Piece(HOLD, load, ("field", constant(nominal)))]
    (time,) = Run(there, pieces, replace(relaxed, time=0.0), rtol=1e-7).events("damage")
    assert UP < time < UP + HOLD
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": prestretch, "relax": 60.0, "stop_at": "damage"}
    material = replace(GENT, damage=InversePower(*damage))
    errors = [abs(damaged(actuate(material, PROGRAMME, rtol=rtol, **film)).time / time - 1) for rtol in (1e-3, 1e-5, 1e-7)]
    assert errors[1] < 2e-4
    assert all(error < 20 * 18.5 * rtol for error, rtol in zip(errors, (1e-3, 1e-5, 1e-7), strict=True))


@pytest.mark.trust
def test_breakdown_is_the_limit_of_a_large_exponent() -> None:
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": 1.9, "relax": 60.0, "stop_at": "end"}
    exponents = np.array([1e2, 1e3, 1e4])
    materials = [replace(GENT, damage=InversePower(2.4e7, 1.0, n)) for n in exponents.tolist()]
    history = actuate(materials, [VoltageStep(6e3, rate=500.0)], breakdown_field=2.4e7, **film)
    at = [next(event.time for event in history.events[0] if event.name == "breakdown")] * 3
    late = np.array([damaged(history, case).time for case in range(3)]) / at - 1
    assert np.all(np.abs(late) < 10 / exponents)
    assert np.all(np.diff(np.abs(late)) < 0)


def test_long_waveforms_add_up() -> None:
    """(1 - cos)/2 to the power of n has the mean C(2n, n)/4^n, and half a cycle does half of the damage of a whole."""
    n, cycles = 6, 12
    peak = 10e3 * 1.7**2 / THICKNESS
    law = InversePower(peak, (cycles - 0.5) * comb(2 * n, n) / 4**n * 0.1, float(n))
    history = actuate(
        replace(ELASTIC, damage=law), [VoltageStep(Waveform(0.0, 10e3, 0.1, cycles))], stop_at="damage", cycles="last", **CLAMPED
    )
    assert damaged(history).time == pytest.approx((cycles - 0.5) * 0.1, rel=1e-8)


def test_a_film_with_the_share_of_weibull_has_failed() -> None:
    """1 - exp(-D^beta), beta = m/n, of draws that are evenly spaced quantiles."""
    draws, shape = 400, 9.0
    factors = WeibullScatter(shape).factors((np.arange(draws) + 0.5) / draws)
    sample = Sample((SILICONE,) * draws, factors, np.ones(draws))
    voltage = [11e3, 13e3, 14e3]
    _, *drawn = solve_map(plan_failure_map(SILICONE, voltage=voltage, horizon=HOUR, sample=sample, **CLAMPED))
    share = np.mean([np.isfinite(each.time_to_failure[0, 0]) for each in drawn], axis=0)
    damage = (np.array(voltage) * 1.7**2 / THICKNESS / 80e6) ** 18.5
    assert share == pytest.approx(1 - np.exp(-(damage ** (shape / 18.5))), abs=1 / draws)


def test_the_table_of_a_run_holds_the_damage() -> None:
    """(V/V_0)^n/t_0 times the time under a clamp; 1 at the event damage, and what the quadrature of the field gives at another."""
    voltage, times = 14e3, np.linspace(0.0, 4000.0, 41)
    programme = [VoltageStep(voltage), VoltageStep.hold(4000.0)]
    rate = (voltage * 1.7**2 / THICKNESS / 80e6) ** 18.5 / HOUR
    for kept in (times, None):
        history = actuate([SILICONE, ELASTIC], programme, stop_at="end", times=kept, **CLAMPED)
        assert history.damage[0] == pytest.approx(rate * history.time[0], rel=1e-9)
        assert np.isnan(history.damage[1]).all()
    assert "damage [1]" not in actuate(ELASTIC, programme, stop_at="end", **CLAMPED).values
    assert rate * 4000.0 > 1  # it goes on after the failure
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": 1.9, "relax": 60.0}
    law = InversePower(2.2e7, 2.0, 6.0)
    for stop, limit in (("damage", 1e9), ("breakdown", 2.3e7)):
        material = replace(GENT, damage=law, breakdown=Breakdown((1.0,), (limit,)))
        history = actuate(material, PROGRAMME, stop_at=stop, points_per_decade=300, **film)
        assert history.events[0][-1].name == stop
        reached = np.isfinite(history.true_field[0])
        time, field, found = history.time[0][reached], history.true_field[0][reached], history.damage[0][reached]
        last, whole = found[-1], float(np.trapezoid(law.rate(field), time))
        assert last == pytest.approx(1.0 if stop == "damage" else whole, rel=1e-7 if stop == "damage" else 2e-4)
        assert np.all(np.diff(found) >= 0)


def test_the_damage_at_failure_may_scatter_by_itself_and_with_the_area() -> None:
    """1 - exp(-(A/A_0) D^beta), of draws that are evenly spaced quantiles; a larger film fails sooner."""
    draws, shape, ratio = 400, 1.3, 4.0
    factors = WeibullScatter(shape, ratio).factors((np.arange(draws) + 0.5) / draws)
    sample = Sample((SILICONE,) * draws, np.full(draws, 1.1), np.ones(draws), factors)
    voltage = [11e3, 13e3, 14e3]
    _, *drawn = solve_map(plan_failure_map(SILICONE, voltage=voltage, horizon=HOUR, sample=sample, **CLAMPED))
    share = np.mean([np.isfinite(each.time_to_failure[0, 0]) for each in drawn], axis=0)
    damage = (np.array(voltage) * 1.7**2 / THICKNESS / 80e6) ** 18.5
    assert share == pytest.approx(1 - np.exp(-ratio * damage**shape), abs=1 / draws)
    drawn = draw_sample([SILICONE], 2000, scatter=FilmScatter(damage=WeibullScatter(shape, ratio)))
    assert drawn.damage_factor is not None
    assert np.mean(drawn.damage_factor < 0.4) == pytest.approx(1 - np.exp(-ratio * 0.4**shape), abs=0.04)
    assert np.mean(drawn.damage_factor < drawn.typical_damage) == pytest.approx(1 - np.exp(-1), abs=0.04)
    with pytest.raises(InputError, match="area_ratio: 0: a positive number is needed"):
        WeibullScatter(1.0, 0.0)


def test_the_film_without_scatter_has_the_area_of_the_draws() -> None:
    """Of films under a constant field, 63.2 % have failed at D = (A/A_0)^(-1/beta); the map of the material and its intervals are
    of one film, also if sources are exchanged between its draws.
    """
    shape, ratio, voltage = 1.5, 40.0, 13e3
    sample = draw_sample([SILICONE], 400, scatter=FilmScatter(damage=WeibullScatter(shape, ratio)))
    arguments: dict[str, Any] = {"voltage": voltage, "horizon": 1e9, **CLAMPED}
    samples = (None, sample, Exchange.of(sample).sample)
    life = [solve_map(plan_failure_map(SILICONE, sample=of, **arguments))[0].time_to_failure.item() for of in samples]
    assert life[0] == pytest.approx(HOUR * (80e6 / (voltage * 1.7**2 / THICKNESS)) ** 18.5, rel=1e-9)
    assert life[1:] == pytest.approx([life[0] * ratio ** (-1 / shape)] * 2, rel=1e-9)
    goal: dict[str, Any] = {"relative_stretch": 1.05, "at": 1.0, "horizon": 1e9, "thickness": THICKNESS, "prestretch": 1.7}
    plain, larger = (design(SILICONE, sample=of, **goal) for of in (None, sample))
    assert plain.failure_mode.tolist() == ["damage"]
    assert plain.voltage == pytest.approx(larger.voltage, rel=1e-6)
    assert larger.time_to_failure == pytest.approx(plain.time_to_failure * ratio ** (-1 / shape), rel=1e-6)
    assert draw_sample([SILICONE], 3, scatter=FilmScatter(damage=WeibullScatter(shape))).typical(SILICONE) is SILICONE


def test_a_map_has_the_cells_of_films_and_only_materials_with_damage_have_it() -> None:
    material = replace(GENT, damage=InversePower(1.9e7, 2.0, 18.5), breakdown=Breakdown((1.0,), (2.9e7,)))
    film: dict[str, Any] = {"thickness": THICKNESS, "relax": 60.0}
    result = failure_map(material, voltage=[2e3, 3.6e3, 3.9e3, 4.6e3], prestretch=[(1.9, 1.9), (2.0, 1.6)], horizon=60.0, **film)
    steps = [VoltageStep(np.array([2e3, 3.6e3, 3.9e3, 4.6e3])), VoltageStep.hold(60.0)]
    for j, prestretch in enumerate(((1.9, 1.9), (2.0, 1.6))):
        for k, events in enumerate(actuate(material, steps, prestretch=prestretch, stop_at="end", **film).events):
            first = {event.name: event.time for event in reversed(events)}
            for name, times in result.times.items():
                assert times[0, j, k] == pytest.approx(first.get(name, np.nan), rel=1e-5, nan_ok=True), (name, j, k)
    assert {"damage", "none"} <= set(result.failure_mode.ravel().tolist())
    assert [column.name for column in result.columns()][4:8] == [
        "time_to_breakdown",
        "time_to_pull_in",
        "time_to_damage",
        "time_to_failure",
    ]
    plain = failure_map(replace(material, damage=None), voltage=[2e3], prestretch=[1.9], horizon=60.0, **film)
    assert list(plain.times) == ["breakdown", "pull-in"]


@pytest.mark.trust
def test_no_film_depends_on_those_it_runs_with() -> None:
    laws = [InversePower(1.9e7, 2.0, 18.5), None, InversePower(2e7, 1.0, 150.0), InversePower(1.9e7, 4.0, 3.0)]
    materials = [replace(GENT, damage=law) for law in laws]
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": 1.9, "relax": 60.0, "stop_at": "pull-in"}
    together = actuate(materials, PROGRAMME, **film)
    for case, material in enumerate(materials):
        assert together.events[case] == actuate(material, PROGRAMME, **film).events[0]


def test_quadrature_is_of_its_order_and_follows_what_is_steep() -> None:
    def error(parts: int) -> float:
        low = np.arange(parts) / parts
        found = _by_rule(FINE, lambda _, x: np.exp(12 * x), np.arange(parts), low, low + 1 / parts)
        return float(abs(found.sum() / (np.expm1(12.0) / 12) - 1))

    assert error(1) > 2**20 * error(2) or error(2) < 1e-14
    power = np.array([0.5, 3.0, 50.0, 2e4])
    found = integrals(lambda columns, x: x ** power[columns], np.zeros(4), np.ones(4))
    assert found == pytest.approx(1 / (power + 1), rel=1e-8)
    spike = integrals(lambda _, x: np.exp(-(((x - 0.3) / 0.01) ** 2)), np.zeros(1), np.ones(1))
    assert spike[0] == pytest.approx(quad(lambda x: np.exp(-(((x - 0.3) / 0.01) ** 2)), 0, 1, points=[0.3])[0], rel=1e-9)


@pytest.mark.parametrize("arguments", [(0.0, 1.0, 1.0), (1e7, 0.0, 1.0), (1e7, 1.0, -1.0), (1e7, 1.0, np.inf), (np.nan, 1.0, 1.0)])
def test_constants_that_make_no_sense_are_refused(arguments: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="a positive number is needed"):
        InversePower(*arguments)
    with pytest.raises(InputError, match=r'stop_at: "damage" cannot happen: the material file needs \[damage\]'):
        actuate(ELASTIC, PROGRAMME, stop_at="damage", **CLAMPED)
