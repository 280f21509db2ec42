"""Voltages applied at once beyond what a film can hold: what happens on the way, in which order, with which sign."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flat import actuate

from dielast.material.material import Material
from dielast.material.shift import WLF, NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.load import VoltageStep
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.stability import TimeScale
from dielast.simulate.events import Event
from reconstruction import spectrum

FULL = spectrum()
# without the fast branches, which would hold any field that a film survives
SLOW = Spectrum(FULL.relaxation_time[:12:2], FULL.shear_modulus[:12:2])
GENT = Material(
    "springs without branches", 26e3, Spectrum(np.ones(1), np.zeros(1)), NoShift(20.0), Gent(110.0), permittivity=3.98e-11
)
FILM = Material("six slow branches", 26e3, SLOW, WLF(20.0, 13.7, 187.1), Gent(110.0), Gent(55.0), 3.98e-11)


def events(*steps: VoltageStep, breakdown: float) -> tuple[Event, ...]:
    history = actuate(FILM, steps, thickness=0.5e-3, prestretch=1.9, relax=5400.0, breakdown_field=breakdown, stop_at="end")
    (found,) = history.events
    return found


@pytest.mark.parametrize(
    "voltage", [pytest.param(4e3, marks=pytest.mark.trust), pytest.param(4.4e3, marks=pytest.mark.trust), -4.4e3]
)
def test_breakdown_on_the_way_to_pull_in_comes_first(voltage: float) -> None:
    at_once = events(VoltageStep(voltage), VoltageStep.hold(1.0), breakdown=48e6)
    assert [(event.name, event.time) for event in at_once] == [("breakdown", 0.0), ("pull-in", 0.0)]
    assert abs(at_once[0].true_field) == pytest.approx(48e6, rel=1e-6)
    # Eq. 21 at the voltage that the film breaks down at
    assert at_once[0].stretch_1 == pytest.approx(np.sqrt(48e6 * 0.5e-3 / abs(at_once[0].voltage)), rel=1e-6)
    assert at_once[0].stretch_1 < at_once[1].stretch_1
    assert all(np.sign(event.voltage) == np.sign(voltage) == np.sign(event.true_field) for event in at_once)
    ramped = events(VoltageStep(voltage, duration=1e-6), VoltageStep.hold(1.0), breakdown=48e6)
    assert ramped[0].name == "breakdown"


def test_snapping_back_is_no_pull_in_and_the_first_pull_in_stays() -> None:
    steps = (
        VoltageStep(2e3),
        VoltageStep.hold(10.0),
        VoltageStep(-2e3),
        VoltageStep.hold(10.0),
        VoltageStep(-4.5e3),
        VoltageStep.hold(1.0),
        VoltageStep(0.0),
        VoltageStep.hold(10.0),
    )
    (pull_in,) = events(*steps, breakdown=1e12)
    assert (pull_in.name, pull_in.time) == ("pull-in", 20.0)
    assert pull_in.voltage == pytest.approx(-3.95e3, rel=0.02)


def test_elastic_pull_in_at_once_keeps_the_sign() -> None:
    elastic = Material("neo-Hookean", 26e3, Spectrum(np.ones(1), np.zeros(1)), NoShift(20.0), permittivity=3.98e-11)
    history = actuate(
        elastic,
        [VoltageStep(-12e3)],
        thickness=0.5e-3,
        breakdown_field=1e12,
        pull_in_timescale=TimeScale.fixed(1.0),
        stop_at="pull-in",
    )
    ((event,),) = history.events
    assert event.voltage == pytest.approx(-0.687365 * np.sqrt(26e3 / 3.98e-11) * 0.5e-3, rel=1e-5)
    assert event.stretch_1 == pytest.approx(4 ** (1 / 6), rel=1e-3)


def test_voltages_that_no_film_holds_are_ruled_out_in_few_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gent, J = 110: each film pulls in where its equilibrium ends, whatever the voltage is; above 2.0965 it never ends."""
    evaluations = 0

    def counted(*arguments: Any) -> Any:
        nonlocal evaluations
        evaluations += 1
        return equations(*arguments)

    equations = PointMaterial.film_tangent
    monkeypatch.setattr(PointMaterial, "film_tangent", counted)
    gent = Material("Gent", 26e3, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), Gent(110.0), permittivity=3.98e-11)
    prestretch, unit = np.array([1.0, 1.7, 1.9, 1.9, 2.05, 2.1]), np.sqrt(26e3 / 3.98e-11) * 0.5e-3
    steps = [VoltageStep(np.array([1.0, 0.3, 0.25, 5.0, 1.0, 1.0]) * unit), VoltageStep.hold(1.0)]
    history = actuate(gent, steps, thickness=0.5e-3, prestretch=prestretch, stop_at="pull-in")
    found = [[(event.stretch_1, event.voltage / unit) for event in events] for events in history.events]
    known = [(1.2634, 0.68918), (2.6653, 0.26065), (3.1351, 0.23871), (3.1351, 0.23871)]
    assert [len(each) for each in found] == [1, 1, 1, 1, 1, 0]
    assert np.array(found[:4])[:, 0] == pytest.approx(np.array(known), rel=1e-4)
    assert evaluations < 2000


def elastic(prestretch: float | tuple[float, float], *steps: VoltageStep, **film: Any) -> tuple[Event, ...]:
    """The first event of each name in a film of Gent springs without branches, up to the end of the steps."""
    history = actuate(GENT, steps, thickness=0.5e-3, prestretch=prestretch, stop_at="end", times=[1e-3], **film)
    (found,) = history.events
    first: dict[str, Event] = {}
    for event in found:
        first.setdefault(event.name, event)
    return tuple(first.values())


@pytest.mark.parametrize(
    ("prestretch", "boundary", "share", "voltage"),
    [
        pytest.param(3.0, "frame", 0.5, 6e3, marks=pytest.mark.trust),
        ((3.358, 3.358), "strip", 0.514, 5639.0),
        (4.0, ("dead-load", "dead-load"), None, 2e4),
    ],
)
def test_a_film_that_holds_a_ramp_holds_the_voltage_at_once(
    prestretch: Any, boundary: Any, share: float | None, voltage: float
) -> None:
    """It stretches so far that a damper at the stretch before the voltage would be beyond the limit of its law."""
    film: dict[str, Any] = {"boundary": boundary, "electrode_share": share}
    at_once = elastic(prestretch, VoltageStep(voltage), VoltageStep.hold(1e-3), **film)
    ramped = elastic(prestretch, VoltageStep(voltage, duration=1e-3), **film)
    assert [event.name for event in at_once] == [event.name for event in ramped]
    assert "pull-in" not in [event.name for event in at_once]
    for event, expected in zip(at_once, ramped, strict=True):
        assert event.time == 0.0
        assert (event.voltage, event.stretch_1) == pytest.approx((expected.voltage, expected.stretch_1), rel=1e-5)


@pytest.mark.parametrize(
    ("prestretch", "boundary", "share", "voltage", "breakdown", "names"),
    [
        ((2.0, 2.0), "strip", 0.5, 6e3, 60e6, ["loss-of-tension", "breakdown"]),
        (2.0, "frame", 0.5, -3.5e3, 30e6, ["breakdown"]),
        ((2.0, 1.5), ("dead-load", "clamped"), None, 6e3, 30e6, ["breakdown", "loss-of-tension"]),
        ((2.0, 2.0), ("clamped", "clamped"), None, 2e4, 60e6, ["loss-of-tension", "breakdown"]),
    ],
)
def test_events_on_the_way_to_a_voltage_that_the_film_holds_are_those_of_a_ramp(
    prestretch: Any, boundary: Any, share: float | None, voltage: float, breakdown: float, names: list[str]
) -> None:
    film: dict[str, Any] = {"boundary": boundary, "electrode_share": share, "breakdown_field": breakdown}
    at_once = elastic(prestretch, VoltageStep(voltage), VoltageStep.hold(1e-3), **film)
    ramped = elastic(prestretch, VoltageStep(voltage, duration=1e-3), **film)
    assert [event.name for event in at_once] == [event.name for event in ramped] == names
    for event, expected in zip(at_once, ramped, strict=True):
        assert event.time == 0.0
        assert (event.voltage, event.stretch_1) == pytest.approx((expected.voltage, expected.stretch_1), rel=1e-5)
    (broken,) = [event for event in at_once if event.name == "breakdown"]
    assert abs(broken.true_field) == pytest.approx(breakdown, rel=1e-6)


def test_clamped_films_lose_their_tension_on_the_way_at_the_closed_form() -> None:
    """Between clamps the stretches stay, and the tension sigma_2 is lost where eps E^2 = sigma_2 (Eqs. 6 and 7 of the paper)."""
    first, second = 2.0, 1.5
    across = 1 / (first * second) ** 2
    stress = 26e3 * (second**2 - across) / (1 - (first**2 + second**2 + across - 3) / 110)
    expected = np.sqrt(stress / 3.98e-11) * 0.5e-3 / (first * second)
    clamped: dict[str, Any] = {"boundary": ("clamped", "clamped"), "breakdown_field": 1e12}
    (event,) = elastic((first, second), VoltageStep(2e4), VoltageStep.hold(1e-3), **clamped)
    assert (event.name, event.time) == ("loss-of-tension", 0.0)
    assert event.voltage == pytest.approx(expected, rel=1e-6)
