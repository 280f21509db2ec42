"""Breakdown by a power law of the stretch and the thickness at the moment: closed forms, the membrane peer, maps, draws."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from films import SOFT
from flat import actuate, failure_map, plan_failure_map
from peers.energies import gent
from peers.kept import Run
from peers.membrane import Film, Piece, constant, ramp

from dielast import Breakdown, Gent, InputError, Material, Sample, Spectrum, VoltageStep
from dielast.handover.material_file import parse_material, write_material
from dielast.material.breakdown import PowerBreakdown
from dielast.material.shift import NoShift
from dielast.simulate.failure_map import solve_map

MU, EPS, THICKNESS, PRESTRETCH = 26e3, 4e-11, 0.5e-3, 1.9
VHB = PowerBreakdown(30.6e6, 1.13)
HUANG = PowerBreakdown(51e6, 0.63, 0.25, 1e-3)
ELASTIC = Material("elastic", MU, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), permittivity=EPS)
MODULUS, TIME = np.array([3e4, 1e5, 3e6]), np.array([30.0, 1.0, 0.01])
GENT = Material("gent", MU, Spectrum(TIME, MODULUS), NoShift(20.0), Gent(110.0), Gent(55.0), EPS)


@pytest.mark.parametrize("law", [VHB, HUANG])
def test_the_law_is_its_formula(law: PowerBreakdown) -> None:
    stretch, thickness = np.array([1.0, 1.5, 4.0]), np.array([1e-3, 0.3e-3, 30e-6])
    stretched, thin = np.array([2.0, 3.0]), np.array([0.1, 0.5])
    assert VHB.of_film(stretch, thickness) == pytest.approx(30.6e6 * stretch**1.13, rel=1e-14)
    assert HUANG.of_film(stretched, thin * 1e-3) == pytest.approx(51e6 * thin**-0.25 * stretched**0.63, rel=1e-14)
    assert law.scaled(0.5).of_film(2.0, 1e-4) == pytest.approx(0.5 * law.of_film(2.0, 1e-4), rel=1e-15)


@pytest.mark.parametrize("law", [VHB, HUANG])
def test_an_elastic_film_breaks_down_where_the_closed_form_says(law: PowerBreakdown) -> None:
    """eps E^2 = mu (l^2 - l^-4) - s l and E = E_B(l, H/l^2), s the stress of the prestretch: here both at l = 2.2."""
    stretch, load = 2.2, MU * (PRESTRETCH - PRESTRETCH**-5)
    field = np.sqrt((MU * (stretch**2 - stretch**-4) - load * stretch) / EPS)
    weak = law.scaled(float(field / law.of_film(stretch, THICKNESS / stretch**2)))
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": PRESTRETCH, "breakdown_field": weak}
    (event,) = [e for e in actuate(ELASTIC, [VoltageStep(2e4, rate=1.0)], **film).events[0] if e.name == "breakdown"]
    assert event.stretch_1 == pytest.approx(stretch, rel=1e-6)
    assert event.voltage == pytest.approx(field * THICKNESS / stretch**2, rel=1e-6)


def test_a_clamped_film_has_the_breakdown_field_of_its_prestretch() -> None:
    weak = HUANG.scaled(0.3)  # breaks down before the film loses its tension
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": (2.0, 1.5), "boundary": "clamped", "breakdown_field": weak}
    history = actuate(GENT, [VoltageStep(5e4, rate=100.0)], **film)
    (event,) = [e for e in history.events[0] if e.name == "breakdown"]
    limit = 0.3 * 51e6 * (0.5 / 3.0) ** -0.25 * 3.0**0.315
    assert event.true_field == pytest.approx(limit, rel=1e-10)
    assert event.voltage == pytest.approx(limit * THICKNESS / 3.0, rel=1e-10)


@pytest.mark.parametrize(("prestretch", "voltage"), [((2.0, 1.6), 4.9e3)])
def test_events_are_those_of_the_peer(prestretch: tuple[float, float], voltage: float) -> None:
    law, up, hold = PowerBreakdown(16e6, 1.13, 0.1, 0.3e-3), 0.5, 8.0
    there = Film(
        lambda l1, l2: gent(l1, l2, MU, 110.0),
        lambda l1, l2: gent(l1, l2, 1.0, 55.0),
        MODULUS,
        TIME,
        EPS,
        breakdown=lambda l1, l2: 16e6 * (l1 * l2) ** 0.565 * (THICKNESS / (l1 * l2) / 0.3e-3) ** -0.1,
    )
    relaxed = Run(there, [Piece(60.0, tuple(("stretch", constant(axis)) for axis in prestretch))], rtol=1e-6).final
    load, field = tuple(("stress", constant(stress)) for stress in relaxed.stress), voltage / THICKNESS
    pieces = [Piece(up, load, ("field", ramp(0.0, field, up))), Piece(hold, load, ("field", constant(field)))]
    run = Run(there, pieces, replace(relaxed, time=0.0), rtol=1e-6)
    programme = [VoltageStep(voltage, duration=up), VoltageStep.hold(hold)]
    film: dict[str, Any] = {"thickness": THICKNESS, "prestretch": prestretch, "relax": 60.0, "breakdown_field": law}
    history = actuate(GENT, programme, stop_at="end", **film)
    (event,) = [event for event in history.events[0] if event.name == "breakdown"]
    (time,) = run.events("breakdown")
    assert up < time < up + hold
    assert event.time == pytest.approx(time, rel=2e-5)
    at_prestretch = law.of_film(np.sqrt(np.prod(prestretch)), THICKNESS / np.prod(prestretch))
    fixed = actuate(GENT, programme, stop_at="end", **{**film, "breakdown_field": float(at_prestretch)})
    assert min(e.time for e in fixed.events[0] if e.name == "breakdown") < 0.9 * event.time


def test_without_exponents_the_law_is_a_constant_and_large_thickness_exponents_forbid_breakdown() -> None:
    film: dict[str, Any] = {
        "thickness": THICKNESS,
        "prestretch": 1.7,
        "relax": 600.0,
        "horizon": 3600.0,
        "voltage": [3e3, 4.2e3, 4.8e3],
    }
    flat, constant_field = (
        failure_map(SOFT, breakdown_field=law, **film) for law in (PowerBreakdown(4e7), Breakdown((1.0,), (4e7,)))
    )
    assert np.isfinite(flat.time_to_breakdown).any()
    np.testing.assert_allclose(flat.time_to_breakdown, constant_field.time_to_breakdown, rtol=1e-12)
    # E grows as l^2, and so does E_B with b = 1
    never = failure_map(SOFT, breakdown_field=PowerBreakdown(12e6, 0.01, 1.0, THICKNESS), **film)
    assert np.isnan(never.time_to_breakdown).all()


@pytest.mark.trust
def test_maps_films_and_draws_agree() -> None:
    material = replace(SOFT, breakdown=PowerBreakdown(17e6, 1.13, 0.1, 0.3e-3))
    stiff = replace(SOFT, equilibrium_modulus=30e3, breakdown=PowerBreakdown(18e6, 1.0))
    film: dict[str, Any] = {"relax": 600.0, "prestretch": [(1.7, 1.7), (2.0, 1.6)], "horizon": 3600.0, "voltage": [3.6e3, 4.2e3]}
    sample = Sample((stiff, material), np.array([0.9, 1.1]), np.array([1.05, 0.8]))
    main, *drawn = solve_map(plan_failure_map(material, thickness=THICKNESS, rtol=1e-6, sample=sample, **film))
    assert np.isfinite(main.time_to_breakdown).any()
    assert main.breakdown_field[0] == pytest.approx(17e6 * 1.7**1.13 * (THICKNESS / 1.7**2 / 0.3e-3) ** -0.1, rel=1e-12)
    for j, prestretch in enumerate(film["prestretch"]):
        steps = [VoltageStep(np.array(film["voltage"])), VoltageStep.hold(3600.0)]
        histories = actuate(material, steps, thickness=THICKNESS, prestretch=prestretch, relax=600.0, stop_at="end")
        for k, events in enumerate(histories.events):
            times = [event.time for event in events if event.name == "breakdown"]
            assert main.time_to_breakdown[0, j, k] == pytest.approx(min(times, default=np.nan), rel=1e-5, nan_ok=True)
    for index, result in enumerate(drawn):
        member, factor = sample.materials[index], float(sample.breakdown_factor[index])
        assert member.breakdown is not None
        thick = THICKNESS * float(sample.thickness_factor[index])
        alone = failure_map(member, thickness=thick, breakdown_field=member.breakdown.scaled(factor), rtol=1e-6, **film)
        assert np.array_equal(result.failure_mode, alone.failure_mode)
        np.testing.assert_allclose(result.time_to_breakdown, alone.time_to_breakdown, rtol=2e-3)


@pytest.mark.trust
def test_films_of_several_laws_run_together_as_each_would_alone() -> None:
    laws = [PowerBreakdown(17e6, 1.13, 0.1, 0.3e-3), None, Breakdown((1.0,), (3e7,)), PowerBreakdown(18e6, 1.0)]
    materials = [replace(SOFT, breakdown=law) for law in laws]
    steps, film = [VoltageStep(6e3, rate=20.0)], {"thickness": THICKNESS, "prestretch": 1.7, "relax": 60.0, "stop_at": "pull-in"}
    together = actuate(materials, steps, **film)
    for case, material in enumerate(materials):
        assert together.events[case] == actuate(material, steps, **film).events[0]


def test_the_law_is_read_and_written_and_its_mistakes_are_named() -> None:
    file = (
        'name = "film"\nreference_temperature = "20 degC"\n[equilibrium]\nshear_modulus = "26 kPa"\n'
        '[nonequilibrium]\nrelaxation_time_s = []\nshear_modulus_Pa = []\n[shift]\nlaw = "none"\n'
        '[dielectric]\npermittivity = "4e-11 F/m"\n[breakdown]\nlaw = "power"\nfield = "51 MV/m"\n'
        'stretch_exponent = 0.63\nthickness_exponent = 0.25\nreference_thickness = "1 mm"\n'
    )
    material = parse_material(file.encode(), "film.toml")
    assert material.breakdown == HUANG
    assert parse_material(write_material(material), "again.toml").breakdown == HUANG
    for old, new, message in (
        ('reference_thickness = "1 mm"\n', "", "breakdown: thickness_exponent needs reference_thickness"),
        ('"1 mm"', '"1 kV"', "breakdown.reference_thickness"),
        ("0.25", "-0.25", "breakdown.thickness_exponent: -0.25: at least 0 is needed"),
        ('field = "51 MV/m"\n', "", 'breakdown: law "power" needs field'),
        ('"51 MV/m"', '["51 MV/m", "40 MV/m"]', "breakdown: field: one value is needed, not 2"),
        ('law = "power"\n', "", 'breakdown: law "table" does not take reference_thickness'),
    ):
        assert old in file
        with pytest.raises(InputError) as caught:
            parse_material(file.replace(old, new, 1).encode(), "film.toml")
        assert message in str(caught.value)
    for arguments in ((0.0,), (np.nan,), (3e7, np.inf), (3e7, 1.0, -1.0, 1e-3), (3e7, 1.0, 1.0, 0.0), (3e7, 1.0, 1.0)):
        with pytest.raises(InputError):
            PowerBreakdown(*arguments)
