"""Films with springs of each law against the membrane peer, to 1e-7: relaxation and creep in three modes, and under voltage."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from flat import actuate, creep, relax
from peers import energies
from peers.kept import Run
from peers.membrane import Piece, constant, ramp
from springs import EPS, MU, SPRINGS

from dielast import Gent, Material, Spectrum, Step, VoltageStep
from dielast.material.shift import NoShift

THICKNESS = 0.5e-3
WITHIN, PEER, OURS = 1e-7, 6e-8, 4e-9  # of the results; tolerances asked of the two
FREE = ("stress", constant(0.0))
MODES = ("uniaxial", "equibiaxial", "pure-shear")


# over the three tests below, every law is used in three ways, laws that differ in two, and every test has every mode
NAMES = tuple(SPRINGS)


def cases(second: Iterable[str], short: tuple[str, ...]) -> list[Any]:
    """Each law with its mode or film; those that the peer follows in less than a second are enough for every day."""
    pairs = zip(NAMES, second, strict=False)
    return [pytest.param(name, other, marks=[] if name in short else pytest.mark.trust) for name, other in pairs]


TIMES = np.concatenate((np.linspace(0.2, 1.0, 5), 1.0 + np.geomspace(1e-2, 20.0, 10)))


@pytest.mark.parametrize(("name", "mode"), cases((*MODES, *MODES[:2], "pure-shear", "uniaxial"), ("yeoh", "ogden")))
def test_relaxation(name: str, mode: str) -> None:
    springs, end = SPRINGS[name], 2.0

    def axes(course: Any) -> Any:
        held = ("stretch", course)
        return held, {"uniaxial": FREE, "equibiaxial": held, "pure-shear": ("stretch", constant(1.0))}[mode]

    run = Run(springs.film, [Piece(1.0, axes(ramp(1.0, end, 1.0))), Piece(20.0, axes(constant(end)))], rtol=PEER)
    there = run.at(TIMES)
    here = relax(springs.material, [Step(stretch=end, rate=1.0), Step.hold(20.0)], mode=mode, times=TIMES, rtol=OURS)
    assert here.stretch_2[0] == pytest.approx(there.stretch[1], rel=WITHIN)
    assert here.nominal_stress_1[0] == pytest.approx(there.stress[0], rel=WITHIN)


@pytest.mark.parametrize(("name", "mode"), cases((*MODES[1:], *MODES, *MODES[:2]), ("gent", "mooney-rivlin")))
def test_creep(name: str, mode: str) -> None:
    springs, end = SPRINGS[name], 3e4

    def axes(course: Any) -> Any:
        pulled = ("stress", course)
        return pulled, {"uniaxial": FREE, "equibiaxial": pulled, "pure-shear": ("stretch", constant(1.0))}[mode]

    run = Run(springs.film, [Piece(1.0, axes(ramp(0.0, end, 1.0))), Piece(20.0, axes(constant(end)))], rtol=PEER)
    there = run.at(TIMES)
    here = creep(springs.material, [Step(stress=end, duration=1.0), Step.hold(20.0)], mode=mode, times=TIMES, rtol=OURS)
    assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(there.stretch, rel=WITHIN)


@pytest.mark.trust
def test_mixed_control() -> None:
    """Axis 1 is stretched and held while axis 2 carries a growing load: no symmetry to hide behind."""
    springs = SPRINGS["yeoh"]
    moving, still = (("stretch", ramp(1.0, 1.5, 1.0)), ("stress", ramp(0.0, 4e4, 1.0))), (1.5, 4e4)
    held = ("stretch", constant(still[0])), ("stress", constant(still[1]))
    there = Run(springs.film, [Piece(1.0, moving), Piece(20.0, held)], rtol=PEER).at(TIMES)
    steps = [Step(stretch=(1.5, None), stress=(None, 4e4), duration=1.0), Step.hold(20.0)]
    here = creep(springs.material, steps, times=TIMES, rtol=OURS)
    assert here.stretch_2[0] == pytest.approx(there.stretch[1], rel=WITHIN)
    assert here.nominal_stress_1[0] == pytest.approx(there.stress[0], rel=WITHIN)


@pytest.mark.parametrize(("name", "film"), cases((*("clamped", "even", "uneven") * 2, "even"), ("yeoh", "mixed")))
def test_actuation(name: str, film: str) -> None:
    prestretch = (1.6, 1.6) if film == "even" else (1.8, 1.4)
    boundary: tuple[str, str] = ("dead-load", "clamped") if film == "clamped" else ("dead-load", "dead-load")
    springs, voltage, up, hold = SPRINGS[name], 4e3, 0.5, 5.0
    held = tuple(("stretch", constant(stretch)) for stretch in prestretch)
    relaxed = Run(springs.film, [Piece(30.0, held)], rtol=PEER).final
    loads = tuple(held[axis] if boundary[axis] == "clamped" else ("stress", constant(relaxed.stress[axis])) for axis in range(2))
    field = voltage / THICKNESS
    run = Run(
        springs.film,
        [Piece(up, loads, ("field", ramp(0.0, field, up))), Piece(hold, loads, ("field", constant(field)))],
        relaxed.__class__(relaxed.log_viscous, relaxed.log_stretch, relaxed.stress),
        rtol=PEER,
    )
    times = np.concatenate((np.linspace(0.1, up, 4), up + np.geomspace(1e-2, hold, 8)))
    there = run.at(times)
    here = actuate(
        springs.material,
        [VoltageStep(voltage, duration=up), VoltageStep.hold(hold)],
        thickness=THICKNESS,
        prestretch=prestretch,
        boundary=boundary,
        relax=30.0,
        stop_at="end",
        times=times,
        rtol=OURS,
    )
    assert np.stack((here.stretch_1[0], here.stretch_2[0])) == pytest.approx(there.stretch, rel=WITHIN)
    assert here.true_field[0] == pytest.approx(there.true_field, rel=WITHIN)
    pulled_in = [event.time for event in here.events[0] if event.name == "pull-in"]
    assert pulled_in == pytest.approx(run.events("pull-in"), rel=WITHIN)


def test_materials_of_all_laws_in_one_run_are_those_one_by_one() -> None:
    materials = [springs.material for springs in SPRINGS.values()]
    steps = [Step(stress=2e4, duration=1.0), Step.hold(5.0)]
    together = creep(materials, steps, mode="pure-shear", points_per_decade=3)
    for case, material in enumerate(materials):
        alone = creep(material, steps, mode="pure-shear", points_per_decade=3)
        assert np.array_equal(together.stretch_1[case], alone.stretch_1[0])
    voltages = [VoltageStep(3e3, duration=1.0), VoltageStep.hold(5.0)]
    films = {"thickness": THICKNESS, "prestretch": (1.8, 1.4), "relax": 30.0, "breakdown_field": 1e9, "points_per_decade": 3}
    together_films = actuate(materials, voltages, **films)  # type: ignore[arg-type]
    for case, material in list(enumerate(materials))[::3]:
        alone_film = actuate(material, voltages, **films)  # type: ignore[arg-type]
        assert np.array_equal(together_films.stretch_1[case], alone_film.stretch_1[0])


@pytest.mark.parametrize("name", SPRINGS)
def test_a_film_without_branches_follows_its_equilibrium_spring(name: str) -> None:
    """Purely elastic: nominal stress and stretch under voltage are those of the energy, whatever law the branches would have."""
    springs = SPRINGS[name]
    material = Material("film", MU, Spectrum(np.zeros(0), np.zeros(0)), NoShift(20.0), springs.equilibrium, Gent(50.0), EPS)
    at = 1.8
    here = relax(material, [Step(stretch=at, rate=1.0)], mode="equibiaxial", times=[0.8])
    expected = MU * energies.stress(springs.energies[0], np.array([at]), np.array([at]))[0, 0]
    assert here.nominal_stress_1[0, 0] == pytest.approx(expected, rel=WITHIN)
    film = actuate(
        material, [VoltageStep(2e3, duration=1.0)], thickness=THICKNESS, prestretch=1.5, breakdown_field=1e9, times=[1.0]
    )
    stretch, dead = float(film.stretch_1[0, 0]), energies.stress(springs.energies[0], np.array([1.5]), np.array([1.5]))[0, 0]
    carried = energies.stress(springs.energies[0], np.array([stretch]), np.array([stretch]))[0, 0]
    # s = dW/dl - eps (V/L_3)^2 l^3
    assert MU * (carried - dead) == pytest.approx(EPS * (2e3 / THICKNESS) ** 2 * stretch**3, rel=1e-6)
