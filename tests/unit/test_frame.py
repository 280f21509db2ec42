"""Films with a passive part: what is asked for, what a batch shares, where runs stop, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from films import SOFT
from flat import actuate, creep, failure_map
from toys import Eyring

from dielast import (
    ActuationHistory,
    Breakdown,
    InputError,
    Material,
    NeoHookean,
    NoShift,
    Spectrum,
    Step,
    TimeScale,
    VoltageStep,
    Waveform,
    write_material,
)
from dielast.commands.registry import read_cases
from dielast.material.dielectric import LinearPermittivity
from dielast.material.springs import Ogden
from dielast.mechanics.passive import forms
from dielast.mechanics.passive.framed import Assembly, FramedFilms, Surroundings
from dielast.mechanics.passive.mesh import points_needed
from dielast.mechanics.passive.structure import inverse, rim_stiffness, solved
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, Load
from dielast.mechanics.stability import damped, stability
from dielast.simulate.film_setup import Film
from dielast.simulate.options import Solver
from dielast.simulate.profile import unresolved
from dielast.simulate.setup import set_up

FILM: dict[str, Any] = {"thickness": 5e-4, "relax": 60.0, "boundary": "frame", "electrode_share": 0.1, "breakdown_field": 4e7}
STEPS = [VoltageStep(4e3, duration=1.0), VoltageStep.hold(100.0)]


def driven(steps: list[VoltageStep] = STEPS, **asked: Any) -> ActuationHistory:
    return actuate(SOFT, steps, **(FILM | {"prestretch": 1.8} | asked))


@pytest.mark.parametrize("share", [0.01, 0.3, 0.97])
def test_the_points_of_an_annulus_integrate_and_strain_exactly(share: float) -> None:
    prestretch, points = np.array([1.5]), 5
    structure = forms.disc(np.array([share]), prestretch, points)
    weight = structure.weight[1:, 0]
    assert weight.sum() == pytest.approx(1 / share**2 - 1, rel=1e-11)  # the area
    # l_2 = a + b s, l_1 = a - b s, exactly
    hoop, radial = structure.stretch(structure.home)[::-1, 1:, 0]
    assert hoop == pytest.approx(1.5, rel=1e-12)
    assert radial == pytest.approx(1.5, rel=1e-10)
    place = 0.5 * (1 + np.cos(np.pi * np.arange(points) / points))
    radial, hoop = structure.stretch(1.5 + 0.2 * place[:, None])[:, 1:, 0]
    outer = share**2
    slope = 0.2 / (1 - outer)
    assert hoop + radial == pytest.approx(2 * (1.5 - slope * outer), rel=1e-9)
    s = (hoop - radial) / (2 * slope)
    assert (weight * s**2).sum() == pytest.approx(1 - outer, rel=1e-9)  # int s^2 ds/s^2
    assert structure.rim[1:, 0] @ s == pytest.approx(1.0, rel=1e-9)


def test_few_points_do_where_the_springs_end_next_to_the_prestretch() -> None:
    share, prestretch = np.array([1e-8, 0.3, 0.9, 1 - 1e-8]), 0.999 * np.sqrt(56.5)  # of the springs' limit, where I_1 = 113
    needed = points_needed(PointMaterial.of(SOFT, np.full(4, 20.0), 1e-6), share, np.full(4, prestretch), 1e-6)
    assert ((needed > 0) & (needed < 5)).all()


def test_the_stiffest_springs_find_their_points() -> None:
    """Around a disc of these the film goes slack soon, in a kink; more exactly asked for, there are no fewer points."""
    share = np.array([0.05, 0.3, 0.9])
    springs = PointMaterial.of(replace(SOFT, equilibrium_law=Ogden((1.0,), (20.0,))), np.full(3, 20.0), 1e-6)
    counts = [points_needed(springs, share, np.full(3, 1.9), tolerance) for tolerance in (1e-2, 1e-4, 1e-6)]
    assert (counts[0] > 0).all()
    assert (np.diff(counts, axis=0) >= 0).all()


def test_systems_of_structures_are_solved_and_tell_whether_they_are_positive() -> None:
    rng = np.random.default_rng(3)
    parts = rng.normal(size=(40, 4, 4))
    whole = parts + parts.transpose(0, 2, 1) + 4 * np.eye(4)
    right = rng.normal(size=(40, 4))
    found = solved(whole.transpose(1, 2, 0), right.T[:, None])[:, 0].T
    assert found == pytest.approx(np.linalg.solve(whole, right[..., None])[..., 0], rel=1e-9)
    assert np.array_equal(inverse(whole.transpose(1, 2, 0)), np.linalg.inv(whole).transpose(1, 2, 0))
    beside_singular = inverse(np.stack((np.ones((4, 4)), whole[0]), axis=-1))
    assert np.isnan(beside_singular[..., 0]).all()
    assert np.array_equal(beside_singular[..., 1], np.linalg.inv(whole[0]))
    positive = np.linalg.eigvalsh(whole)[:, 0] > 0
    assert 5 < positive.sum() < 35
    assert ((rim_stiffness(whole.transpose(1, 2, 0)) > 0) == positive).all()


def test_no_case_depends_on_its_neighbours() -> None:
    shares = np.array([0.05, 0.1, 0.6])  # of different numbers of points
    together = driven(electrode_share=shares, times=[0.5, 10.0], stop_at="end", mesh_rtol=1e-5, profile=[10.0])
    assert together.profiles is not None
    for row, share in enumerate(shares):
        alone = driven(electrode_share=share, times=[0.5, 10.0], stop_at="end", mesh_rtol=1e-5, profile=[10.0])
        assert alone.profiles is not None
        assert alone.stretch_1.tolist() == together.stretch_1[[row]].tolist()
        assert alone.stability.tolist() == together.stability[[row]].tolist()
        for header, column in alone.profiles.cases[0].items():
            assert column.tolist() == together.profiles.cases[row][header].tolist()
    stretch = together.relative_stretch_1[:, -1]
    assert stretch[0] > stretch[1] > stretch[2] > 1  # the closer the frame is, the stiffer
    assert stretch[0] < driven(boundary="dead-load", electrode_share=None, times=[10.0], stop_at="end").relative_stretch_1[0, -1]


def test_a_profile_goes_from_the_middle_to_the_frame() -> None:
    history = driven(times=[0.5, 10.0], stop_at="end", profile=[0.0, 0.5, 10.0])
    assert history.profiles is not None
    frame = history.profiles.to_frame()
    assert list(frame.columns) == ["case", *history.profiles.cases[0]]
    there = frame[frame["time [s]"] == 10.0]
    radius, second = there["radius [1]"].to_numpy(), there["stretch_2 [1]"].to_numpy()
    assert (radius[:3].tolist(), radius[-1]) == ([0.0, 1.0, 1.0], pytest.approx(10.0))
    assert second[:2] == pytest.approx(history.stretch_1[0, -1], rel=1e-12)
    assert (second[2], second[-1]) == (pytest.approx(second[1], rel=1e-4), pytest.approx(1.8, rel=1e-4))
    assert (np.diff(second[2:]) < 0).all()
    begin = frame[frame["time [s]"] == 0.0]
    assert begin["nominal_stress_1 [Pa]"].to_numpy() == pytest.approx(begin["nominal_stress_2 [Pa]"].to_numpy(), rel=1e-6)
    strip = driven(prestretch=(1.8, 1.5), boundary="strip", electrode_share=0.25, times=[10.0], stop_at="end", profile=[10.0])
    assert strip.profiles is not None
    columns = strip.profiles.cases[0]
    assert columns["radius [1]"].tolist() == [0.0, 1.0, 1.0, 4.0]
    first = columns["stretch_1 [1]"]
    assert 0.25 * first[0] + 0.75 * first[-1] == pytest.approx(1.8, rel=1e-7)
    assert np.ptp(columns["nominal_stress_1 [Pa]"]) < 1e-4 * columns["nominal_stress_1 [Pa]"][0]


def test_a_profile_of_a_slack_film_has_no_film_that_passes_through_itself() -> None:
    """A mesh for a taut film yields negative radial stretches once it is slack, and r(A) = l_a A does not hold."""
    high = [VoltageStep(8e3, duration=1.0), VoltageStep.hold(100.0)]
    history, fine = (driven(high, stop_at="end", profile=[0.0, 10.0, 100.0], mesh_rtol=rtol) for rtol in (1e-6, 1e-10))
    slack = next(event.time for event in history.events[0] if event.name == "loss-of-tension")
    assert 10.0 < slack < 100.0
    assert history.profiles is not None
    assert fine.profiles is not None
    coarse, (exact,) = history.profiles.cases[0], fine.profiles.cases
    first = coarse["stretch_1 [1]"]
    empty = np.isnan(first)
    assert empty.any()
    assert set(coarse["time [s]"][empty]) == {100.0}
    assert np.all(first[~empty] > 0)
    for name in ("stretch_2 [1]", "nominal_stress_1 [Pa]", "nominal_stress_2 [Pa]"):
        assert np.array_equal(np.isnan(coarse[name]), empty)
    assert np.isfinite(coarse["radius [1]"]).all()
    assert unresolved(coarse).tolist() == [100.0]
    assert np.all(exact["stretch_1 [1]"] > 0)
    # the disc itself hardly depends on the mesh
    assert history.stretch_1[0, -1] == pytest.approx(fine.stretch_1[0, -1], rel=1e-4)


def test_an_edge_that_is_torn_is_not_resolved() -> None:
    there = np.array([0.0, 1.0, 1.0, 10.0])
    profile = {"time [s]": np.repeat([1.0, 2.0, 3.0], 4), "radius [1]": np.tile(there, 3)}
    hoop = np.array([2.0, 2.0, 2.0001, 1.8, 2.0, 2.0, 2.0003, 1.8, 2.0, 2.0, 2.0, np.nan])
    assert unresolved(profile | {"stretch_2 [1]": hoop}).tolist() == [2.0, 3.0]
    assert unresolved({name: values[:0] for name, values in (profile | {"stretch_2 [1]": hoop}).items()}).size == 0


def test_a_run_stops_where_the_film_around_goes_slack_unless_asked_to_go_on() -> None:
    high = [VoltageStep(8e3, duration=1.0), VoltageStep.hold(100.0)]
    stopped, on = (driven(high, breakdown_field=1e9, stop_at=at) for at in ("breakdown", "end"))
    (event,) = stopped.events[0]
    assert (event.name, stopped.outcome[0].reason, stopped.outcome[0].time) == ("loss-of-tension", "loss-of-tension", event.time)
    assert abs(stopped.nominal_stress_1[0][np.isfinite(stopped.nominal_stress_1[0])][-1]) < 1.0
    assert on.outcome[0].completed
    assert [own for own in on.events[0] if own.name == "loss-of-tension"] == [event]
    assert driven(high).outcome[0].reason == "breakdown"  # which comes first


@pytest.mark.trust
def test_stability_of_a_strip_with_next_to_no_active_part_is_that_under_a_dead_load() -> None:
    film: dict[str, Any] = {"prestretch": (1.2, 1.5), "stop_at": "end", "times": [0.1, 1.0, 10.0], "rtol": 1e-8, "relax": 1e8}
    for scale in (TimeScale.fraction(0.01), TimeScale.fixed(0.0)):
        strip = driven(**film, boundary="strip", electrode_share=1e-7, pull_in_timescale=scale)
        load = driven(**film, boundary=("dead-load", "clamped"), electrode_share=None, pull_in_timescale=scale)
        assert strip.stability == pytest.approx(load.stability, rel=1e-5)
        assert strip.stretch_1 == pytest.approx(load.stretch_1, rel=1e-6)


def test_without_a_passive_part_the_stiffness_at_the_rim_is_the_factor_of_the_determinant_that_falls() -> None:
    """2 (ds_1/dl_1 + ds_1/dl_2) of an equibiaxial film, (t11 - t12)(t11 + t12) being the determinant of dead load."""
    cases, stretch = 30, 2.0
    points, one = damped(PointMaterial.of(SOFT, np.full(30, 20.0), 1e-6)), np.ones(cases)
    alone = forms.Structure(one[None], np.ones((2, 1, 1, cases)), np.zeros((2, 1, cases)), one[None], one[None])
    rng = np.random.default_rng(1)
    viscous = np.exp(0.2 * rng.normal(size=(1, len(points.modulus), cases))) * stretch
    internal, field = np.repeat(viscous, 2, axis=0)[:, :, None], np.linspace(0.0, 8e7, cases)
    around = Surroundings(Assembly.of(points, alone), np.concatenate((stretch * one[None], np.zeros((2, cases)))))
    nominal = around.stresses(internal, field)[:, 0]
    log_squared = np.full((2, cases), 2 * np.log(stretch))
    film, watched = (2 * np.log(internal[:, :, 0]), log_squared, nominal, field), 10 ** rng.uniform(-3, 3, cases)
    free, clamped = Control.STRESS, Control.STRETCH
    determinant = stability(points, (free, free), *film, watched).determinant
    own = stability(points, (free, clamped), *film, watched).determinant
    rim, whole = around.stiffness(watched, internal, field)
    across = 0.5 * rim - own
    assert np.abs(own**2 - across**2) == pytest.approx(np.abs(determinant), rel=1e-9)
    assert ((rim > 0) == (determinant > 0)).all()
    assert 5 < (rim > 0).sum() < 25
    assert (whole > 0).all()


def test_a_film_without_equilibrium_modulus_is_divided_as_one_of_any_modulus() -> None:
    steps, film = [VoltageStep(2.5e3), VoltageStep.hold(10.0)], FILM | {"prestretch": 1.5, "relax": 10.0, "times": [0.0, 1.0, 10.0]}
    spectrum = Spectrum(np.array([100.0]), np.array([6e4]))
    materials = [Material("one branch", modulus, spectrum, NoShift(20.0), permittivity=3.98e-11) for modulus in (0.0, 1e-3, 26e3)]
    share, prestretch = np.array([0.01, 0.3, 0.9]), np.full(3, 2.0)
    counts = [points_needed(PointMaterial.of(each, np.full(3, 20.0), 1e-6), share, prestretch, 1e-6).tolist() for each in materials]
    assert min(counts[0]) > 0
    assert counts[0] == counts[1] == counts[2]
    liquid, softest = (actuate(each, steps, **film) for each in materials[:2])
    assert liquid.outcome[0].completed
    assert liquid.relative_stretch_1[0, -1] > liquid.relative_stretch_1[0, 0] > 1.01
    assert liquid.stretch_1 == pytest.approx(softest.stretch_1, rel=1e-6)


def test_a_voltage_applied_at_once_that_a_film_cannot_hold_is_a_pull_in() -> None:
    soft, hard = (driven([VoltageStep(volts)], stop_at="end", prestretch=2.5) for volts in (3e3, 1.2e4))
    assert not [event for event in soft.events[0] if event.name == "pull-in"]
    (pulled,) = [event for event in hard.events[0] if event.name == "pull-in"]
    assert (pulled.time, hard.outcome[0].completed) == (0.0, True)


def test_cycles_of_a_framed_film_take_work_from_the_voltage_alone() -> None:
    """In a cycle that repeats itself it is lost, and so positive; more than in the disc alone."""
    wave = [VoltageStep(Waveform(0.0, 3e3, 1.0, cycles=5))]
    history = driven(wave, stop_at="end", cycles="last")
    assert history.cycles is not None
    assert history.cycles.work[0, -1] > 0
    assert history.cycles.lowest[0, -1] > 1
    assert history.cycles.phase[0, -1] < 0


def test_a_map_has_an_axis_of_shares() -> None:
    given: dict[str, Any] = {"voltage": [6e3], "thickness": 5e-4, "horizon": 1e4, "relax": 60.0, "boundary": "frame"}
    result = failure_map(SOFT, prestretch=[1.7, 1.9], electrode_share=[0.05, 0.2], breakdown_field=[4e7, 4.8e7], **given)
    assert result.time_to_failure.shape == (1, 4, 1)
    assert result.electrode_share is not None
    assert result.electrode_share.tolist() == [0.05, 0.2] * 2
    assert result.breakdown_field.tolist() == [4e7, 4e7, 4.8e7, 4.8e7]
    assert "electrode_share [1]" in result.to_frame().columns
    one = failure_map(SOFT, prestretch=[1.9], electrode_share=0.2, breakdown_field=4.8e7, **given)
    assert one.time_to_failure[0, 0].tolist() == result.time_to_failure[0, 3].tolist()
    assert result.time_to_loss_of_tension is not None
    slack = result.time_to_loss_of_tension[0, 3]
    (event,) = driven([VoltageStep(6e3), VoltageStep.hold(1e4)], prestretch=1.9, electrode_share=0.2, breakdown_field=1e9).events[0]
    assert (event.name, slack[0]) == ("loss-of-tension", pytest.approx(event.time, rel=1e-5))
    times = result.time_to_failure[0]
    assert (times[0::2] < times[1::2]).all()  # a frame further away holds the disc less


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"electrode_share": None}, "electrode_share: boundary frame needs the electrode's share of the radius of the frame"),
        (
            {"electrode_share": 1.0},
            "electrode_share: 1: .* must lie between 1e-08 and 1 - 1e-08; a film without a passive part is clamped",
        ),
        ({"electrode_share": [0.1, -0.1]}, "case 1: electrode_share: -0.1"),
        ({"boundary": "dead-load"}, "electrode_share: only a film with boundary frame or strip has an electrode share"),
        ({"prestretch": (2.0, 1.5)}, "prestretch: 2 x 1.5: a round frame needs an equibiaxial prestretch; for a pair use"),
        ({"prestretch": (2.0, None)}, "prestretch: boundary frame needs the prestretch of both axes"),
        (
            {"mesh_rtol": 1e-12, "electrode_share": 0.99999},
            "mesh_rtol: 1e-12: no division of the film around an electrode of share 0.99999",
        ),
        ({"electrode_share": 1e-300}, "electrode_share: 1e-300: .* must lie between 1e-08 and 1 - 1e-08"),
        (
            {"electrode_share": [0.1, 1 - 1e-9]},
            "case 1: electrode_share: 0.999999999: .*; a film without a passive part is clamped",
        ),
        ({"boundary": "strip", "mesh_rtol": 1e-4}, "mesh_rtol: only a film with boundary frame has a mesh"),
        (
            {"electrical": True},
            "electrical: a film with a passive part, boundary frame or strip, can only be driven by an ideal source",
        ),
        ({"resistance": 1e6, "electrode_area": 1e-4}, "resistance: a film with a passive part"),
        ({"mesh_rtol": 0.0}, "mesh_rtol: 0 is not between"),
        ({"boundary": ("frame", "clamped")}, "boundary: .* or frame, or strip"),
        ({"profile": [-1.0]}, "profile: output times must be finite and not negative"),
        ({"profile": [1e3]}, "profile: 1000 s lies after the end of the programme"),
        ({"boundary": "clamped", "electrode_share": None, "profile": [1.0]}, "profile: a profile needs a film with a passive part"),
    ],
)
def test_bad_films(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        driven(**change)


RECIPE = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
boundary = "frame"
{}
[[step]]
voltage = "4 kV"
"""
DIAMETERS = 'electrode_diameter = "{}"\nframe_diameter = "{}"'


def recipe(folder: Path, film: str) -> Any:
    (folder / "r.toml").write_text(film if "kind" in film else RECIPE.format(film))
    return read_cases(folder / "r.toml")[0].recipe


def test_a_recipe_states_a_share_or_both_diameters(tmp_path: Path) -> None:
    assert recipe(tmp_path, DIAMETERS.format("10 mm", "190.5 mm")).film.shares == (10 / 190.5,)
    assert recipe(tmp_path, 'electrode_share = "5 %"').film.shares == (0.05,)
    assert recipe(tmp_path, 'electrode_share = 0.05\nelectrode_diameter = "10 mm"').film.shares == (0.05,)
    # beside a frame the other boundaries, which have no share, may be swept
    sweep = '[sweep]\n"film.boundary" = ["dead-load", "frame"]\n'
    (tmp_path / "s.toml").write_text(RECIPE.format(DIAMETERS.format("10 mm", "190.5 mm")) + sweep)
    assert [case.recipe.film.shares for case in read_cases(tmp_path / "s.toml")] == [None, (10 / 190.5,)]


def test_a_weight_is_a_dead_load() -> None:
    """It stretches the film from the beginning; what was at rest under a stress moves as under a prestretch to that stretch."""
    given: dict[str, Any] = {"thickness": 5e-4, "stop_at": "end", "times": [0.0, 10.0], "boundary": ("dead-load", "clamped")}
    force, width, relax = 0.6, 0.02, 1e3
    soft = replace(SOFT, spectrum=Spectrum([1.0], [1e5]))
    weight_stress = actuate(soft, STEPS, **given, relax=relax, prestretch=(None, 2.0), force=force, width=width)
    assert weight_stress.nominal_stress_1[0] == pytest.approx(force / (width * 5e-4), rel=1e-9)
    held = actuate(soft, STEPS, **given, relax=relax, prestretch=(float(weight_stress.stretch_1[0, 0]), 2.0))
    assert weight_stress.stretch_1[0] == pytest.approx(held.stretch_1[0], rel=1e-5)
    assert weight_stress.relative_stretch_1[0, 0] == 1.0
    asked: dict[str, Any] = {"voltage": [3e3], "prestretch": [(1.0, 2.0)], "thickness": 5e-4, "horizon": 1e4, "relax": relax}
    given = asked | {"boundary": ("dead-load", "clamped"), "breakdown_field": 3e7}
    times = failure_map(soft, **given, force=force, width=width).time_to_failure
    pair = [(float(weight_stress.stretch_1[0, 0]), 2.0)]
    assert times == pytest.approx(failure_map(soft, **(given | {"prestretch": pair})).time_to_failure, rel=1e-4, nan_ok=True)
    # all of it, while the other axis is slowly stretched: by next to nothing, which is creep in pure shear
    slow: dict[str, Any] = {"prestretch": (None, 1 + 1e-9), "prestretch_rate": 1e-11, "thickness": 5e-4}
    crept = creep(soft, [Step(stress=force / (width * 5e-4)), Step.hold(100.0)], mode="pure-shear").stretch_1[0, -1]
    weight: dict[str, Any] = {"force": force, "width": width, "boundary": ("dead-load", "clamped")}
    mounted = actuate(soft, STEPS, **slow, **weight, stop_at="end").stretch_1[0, 0]
    assert mounted == pytest.approx(crept, rel=1e-5)


@pytest.mark.parametrize("pair", [(1.0, 2.0), (2.0, 1.0)])
def test_an_axis_without_force_is_free(tmp_path: Path, pair: tuple[float, float]) -> None:
    """Clamped width l_p, S_1 = 0, neo-Hookean: l_1 = [l_p^2 (1 - e^2 l_p^2)]^(-1/4) with e = sqrt(eps/mu) E~."""
    free = pair.index(1.0)
    boundary = ("dead-load", "clamped") if free == 0 else ("clamped", "dead-load")
    forces, widths = ((0.0, None), (0.01, None)) if free == 0 else ((None, 0.0), (None, 0.01))
    stated = tuple(None if axis == free else pair[axis] for axis in range(2))
    given: dict[str, Any] = {"thickness": 5e-4, "prestretch": stated, "boundary": boundary, "stop_at": "end", "times": [1.0]}
    rubber = Material("rubber", 26e3, Spectrum((), ()), NoShift(20.0), NeoHookean(), NeoHookean(), 3.98e-11)
    volts = np.array([0.0, 2e3, 4e3])
    steps = [VoltageStep(volts, duration=1.0)]
    squared = 3.98e-11 / 26e3 * (volts / 5e-4) ** 2
    expected = (4 * (1 - 4 * squared)) ** -0.25
    for weight in ({"force": forces, "width": widths}, {}):
        stretch = getattr(actuate(rubber, steps, **given, **weight), f"stretch_{free + 1}")[:, -1]
        assert stretch == pytest.approx(expected, rel=1e-6)
    if free == 0:
        film = 'thickness = "0.5 mm"\nprestretch = [1, 2]\nboundary = ["dead-load", "clamped"]\nforce = "0 N"\nwidth = "1 cm"\n'
        (tmp_path / "m.toml").write_bytes(write_material(rubber))
        path = tmp_path / "r.toml"
        path.write_text(f'kind = "actuate"\nmaterial = "m.toml"\n[film]\n{film}[[step]]\nvoltage = "4 kV"\n')
        (case,) = read_cases(path, "actuate", ())
        assert case.recipe.film.weights == ((0.0, None), (0.01, None))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": None}, "force: the film's width is needed, too"),
        ({"force": None}, "width: there is no force on axis 1"),
        ({"force": -1.0}, "force: -1 N: it must not be negative"),
        ({"boundary": "clamped"}, "force: a weight along axis 1 is for boundary dead-load alone"),
        ({"prestretch": 1.8}, "prestretch: axis 1: this axis is stretched by its weight"),
        ({"force": (1.0, 2.0, 3.0)}, "force: 3 values"),
        (
            {"breakdown_field": Breakdown((1.0, 2.0), (3e7, 4e7))},
            "breakdown_field: the prestretch under a weight is not known",
        ),
    ],
)
def test_bad_weights(change: dict[str, Any], message: str) -> None:
    weighted: dict[str, Any] = {"boundary": "dead-load", "electrode_share": None, "force": 1.0, "width": 0.02}
    with pytest.raises(InputError, match=message):
        driven(**(weighted | {"prestretch": (None, 2.0)} | change))


@pytest.mark.parametrize("boundary", ["frame", "strip"])
@pytest.mark.parametrize(
    "change", [{}, {"permittivity": LinearPermittivity(4e-11, stretch_coefficient=-0.05)}, {"flow": Eyring(3e4)}]
)
def test_increments_are_those_of_the_exact_jacobian(boundary: str, change: dict[str, Any]) -> None:
    """(M/gamma - h J) u = h f + M history + h^2 gamma_i df/dt, J by differences, from a state off equilibrium."""
    material = replace(SOFT, **change)
    asked = Film(1e-3, 2.0, None, 100.0, boundary, np.array([0.3, 0.3]))
    setup = set_up(material, asked, breakdown_field=None, solver=Solver())
    film = setup.film(np.arange(2), 1e-6)
    start = film.prescribed(setup.controls)
    start[2] = 1e6
    end = start.copy()
    end[2] = 6e6
    load = Load.between(setup.controls, start, end, np.full(2, 10.0))
    system = film.equations(load)
    assert isinstance(system, FramedFilms)
    assembly, border = system.assembly, system.border
    rng = np.random.default_rng(0)
    rows = film.state(system)[:, 0]
    size = np.where(np.arange(rows.size) < rows.size - 2, 1.0, 1e4)
    state = rows + 0.02 * rng.normal(size=rows.size) * size

    def equations(time: float, column: np.ndarray) -> np.ndarray:
        both = np.stack((column, column), axis=1)
        stretch, viscous = assembly.structure.stretch(both[border:-2]), system.internal(both)
        stress = assembly.all_points.law.stress(assembly.springs(viscous, stretch))
        flow = 0.5 * viscous.reshape(stress.shape) * (3 * stress - stress.sum(axis=0)) * assembly.all_points.flow.fluidity
        if "flow" in change:  # not the damper
            over = (assembly.all_points.modulus * np.sqrt(stress[0] ** 2 - stress[0] * stress[1] + stress[1] ** 2))[1:-1] / 3e4
            flow[:, 1:-1] *= np.sinh(over) / over
        nominal = assembly.carried(stress, assembly.maxwell_stress(stretch, load.value(np.full(2, time))[2])) / stretch
        rest = assembly.structure.force(nominal), assembly.structure.border(nominal) - both[-2:]
        return np.concatenate((flow.reshape(-1, 2), *rest))[:, 0]

    step, gamma, begin = 0.7, 0.2, 3.0
    small = 1e-6 * np.maximum(1.0, np.abs(state))
    columns = [(equations(begin, state + each) - equations(begin, state - each)) / (2 * each.max()) for each in np.diag(small)]
    jacobian, in_time = np.stack(columns, axis=1), (equations(begin + 1e-4, state) - equations(begin - 1e-4, state)) / 2e-4
    mass = np.where(np.arange(rows.size) < rows.size + border, 1.0, 0.0)
    times = begin + np.array([[0.0, 0.0], [0.1, 0.1]])
    linearised = system.linearise(times, np.stack((state, state), axis=1), np.full(2, step), gamma)
    for stage, history, gamma_i in ((0, None, 0.2), (1, 0.01 * rng.normal(size=rows.size), -0.4)):
        there = state if history is None else state + 0.01 * rng.normal(size=rows.size) * size
        right = step * equations(times[stage, 0], there) + step**2 * gamma_i * in_time
        right += 0.0 if history is None else mass * history
        wanted = np.linalg.solve(np.diag(mass / gamma) - step * jacobian, right)
        given = None if history is None else np.stack((history, history), axis=1)
        there_twice = np.stack((there, there), axis=1)
        found = linearised.increment(stage, there_twice, given, gamma_i, np.empty(there_twice.shape))[:, 0]
        assert found[:-2] == pytest.approx(wanted[:-2], rel=1e-6, abs=1e-7)
        assert found[-2:] == pytest.approx(wanted[-2:], rel=1e-6, abs=1e-6 * np.abs(wanted[-2:]).max())
