"""The membrane peer against closed forms and its own balance of energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from peers import closed_forms as forms
from peers.energies import gent, mooney_rivlin, neo_hookean, ogden
from peers.membrane import Film, Piece, Run, State, at_rest, constant, fold, ramp

pytestmark = pytest.mark.trust

MU, EPS = 26e3, 4e-11
NONE = np.zeros(0)
UNIT_FIELD, UNIT_CHARGE = np.sqrt(MU / EPS), np.sqrt(MU * EPS)
FREE = ("stress", constant(0.0))
MODULUS, TIME = np.array([2e4, 5e4, 1e5]), np.array([30.0, 2.0, 0.1])


def soft(l1: Any, l2: Any) -> Any:
    return neo_hookean(l1, l2, MU)


def stiffening(l1: Any, l2: Any) -> Any:
    return gent(l1, l2, MU, 110.0)


def branch(l1: Any, l2: Any) -> Any:
    return gent(l1, l2, 1.0, 55.0)


def test_charge_takes_a_film_through_the_stretch_at_which_a_voltage_pulls_it_in() -> None:
    film = Film(soft, soft, NONE, NONE, EPS)
    run = Run(film, [Piece(1.0, (FREE, FREE), ("charge", ramp(0.0, 3 * UNIT_CHARGE, 1.0)))])
    times = np.linspace(0.1, 1.0, 7)
    there = run.at(times)
    wanted = [forms.charged_stretch((3 * t) ** 2) for t in times]
    assert there.stretch == pytest.approx(np.stack((wanted, wanted)), rel=1e-13)
    assert (run.determinant(times) > 0).all()
    assert not run.events("pull-in")
    # d = sqrt(3) is where the field of the same film is largest
    stretch, field = forms.neo_hookean_pull_in()
    top = run.at(np.sqrt(3) / 3 + np.array([-1e-4, 0.0, 1e-4]))
    assert top.stretch[0, 1] == pytest.approx(stretch, rel=1e-13)
    assert top.field[1] == pytest.approx(field * UNIT_FIELD, rel=1e-13)
    assert (top.field[[0, 2]] < top.field[1]).all()
    assert top.true_field[1] == pytest.approx(field * UNIT_FIELD * stretch**2, rel=1e-13)


def test_the_field_determinant_is_zero_at_the_elastic_pull_in() -> None:
    stretch, field = forms.neo_hookean_pull_in()
    film = Film(soft, soft, NONE, NONE, EPS)
    gaps = np.array([1e-2, 1e-4, 1e-6])
    at = [Run(film, [Piece(1.0, (FREE, FREE), ("field", ramp(0.0, field * UNIT_FIELD * (1 - gap), 1.0)))]) for gap in gaps]
    determinants = np.array([run.determinant(1.0)[0] for run in at])
    # sqrt(gap) law of a fold
    assert determinants[1:] / determinants[:-1] == pytest.approx([0.1, 0.1], rel=0.1)
    assert at[-1].at(1.0).stretch[0, 0] == pytest.approx(stretch, rel=1e-3)


def test_a_permittivity_that_falls_with_the_stretch_turns_where_it_should() -> None:
    coefficient = -0.053
    film = Film(soft, soft, NONE, NONE, lambda l1, l2: EPS * (1 + coefficient * (l1 + l2 - 2)))
    stretch, field = forms.softening_dielectric_pull_in(coefficient)
    charge = EPS * (1 + 2 * coefficient * (stretch - 1)) * field * UNIT_FIELD * stretch**4
    run = Run(film, [Piece(1.0, (FREE, FREE), ("charge", ramp(0.0, charge / 0.7, 1.0)))])
    around = run.at(0.7 + np.array([-1e-4, 0.0, 1e-4]))
    assert around.stretch[0, 1] == pytest.approx(stretch, rel=1e-10)
    assert around.field[1] == pytest.approx(field * UNIT_FIELD, rel=1e-10)
    assert (around.field[[0, 2]] < around.field[1]).all()


def test_charge_leaks_out_of_an_insulated_film() -> None:
    conductivity = 1e-13
    film = Film(soft, soft, NONE, NONE, EPS, leakage=lambda field: conductivity * field)
    time = EPS / conductivity
    begin = np.sqrt(3.0) * UNIT_CHARGE
    run = Run(
        film,
        [
            Piece(0.0, (FREE, FREE), ("charge", constant(begin))),
            Piece(2 * time, (FREE, FREE), ("source", constant(0.0))),
        ],
        rtol=1e-9,
    )
    shares = np.array([0.3, 1.0, 1.7])
    there = run.at(shares * time)
    assert there.charge == pytest.approx(begin * np.exp(-shares), rel=1e-8)
    assert there.stretch[0] == pytest.approx([forms.charged_stretch(3 * np.exp(-2 * s)) for s in shares], rel=1e-8)
    assert there.stretch[0, 1] == pytest.approx(1.05844, abs=5e-6)


def test_a_source_charges_a_held_film_through_its_resistance_and_leak() -> None:
    """(e_s - e)/r = eps de/dt + sigma e in a film that cannot move."""
    conductivity, resistance, source = 2e-12, 1e11, 1e7
    film = Film(soft, soft, NONE, NONE, EPS, leakage=lambda field: conductivity * field)
    held = ("stretch", constant(1.0))
    run = Run(film, [Piece(20.0, (held, held), ("source", constant(source)), resistance)], rtol=1e-9)
    times = np.array([0.5, 2.0, 8.0, 20.0])
    pace, share = (conductivity + 1 / resistance) / EPS, 1 / (1 + resistance * conductivity)
    assert run.at(times).field == pytest.approx(source * share * -np.expm1(-pace * times), rel=1e-8)


def test_a_leak_that_grows_with_the_field() -> None:
    """j = sigma_0 E exp(E/E_c), open circuit, held: dE/dt = -j/eps, so the time from E_1 to E_2 is an integral of 1/j."""
    from scipy.integrate import quad

    conductivity, scale, begin, end = 1e-12, 4e6, 1e7, 2e6
    film = Film(soft, soft, NONE, NONE, EPS, leakage=lambda field: conductivity * field * np.exp(field / scale))
    held = ("stretch", constant(1.0))
    time = EPS * quad(lambda field: 1 / (conductivity * field * np.exp(field / scale)), end, begin, epsabs=0, epsrel=1e-12)[0]
    pieces = [Piece(0.0, (held, held), ("charge", constant(EPS * begin))), Piece(time, (held, held), ("source", constant(0.0)))]
    assert Run(film, pieces, rtol=1e-9).final.field == pytest.approx(end, rel=1e-8)


def test_small_strains_relax_as_the_prony_series_does() -> None:
    film, strain = Film(stiffening, branch, MODULUS, TIME), 1e-5
    run = Run(film, [Piece(100.0, (("stretch", constant(1 + strain)), FREE))], rtol=1e-7, atol=1e-13)
    times = np.geomspace(1e-2, 100.0, 9)
    modulus = 3 * (MU + MODULUS @ np.exp(-times / TIME[:, None]))
    assert run.at(times).stress[0] / strain == pytest.approx(modulus, rel=5e-5)


def test_a_film_under_weight_comes_to_rest_on_its_equilibrium_spring() -> None:
    film = Film(stiffening, branch, MODULUS, TIME)
    run = Run(film, [Piece(1e5, (("stress", constant(2 * MU)), FREE))], rtol=1e-6)
    stretch = np.exp(run.final.log_stretch)
    assert stretch[0] == pytest.approx(forms.held_uniaxially(2.0, 110.0), rel=1e-8)
    assert stretch[1] == pytest.approx(stretch[0] ** -0.5, rel=1e-12)


@pytest.mark.parametrize("prestretch", [1.7, 1.9])
def test_an_elastic_dead_load_film_at_its_pull_in(prestretch: float) -> None:
    film = Film(stiffening, stiffening, NONE, NONE, EPS)
    load = ("stress", constant(MU * forms.equibiaxial_stress(prestretch, 110.0) / prestretch))
    stretch, field = forms.turns(prestretch, 110.0)[0]
    run = Run(film, [Piece(1.0, (load, load), ("field", ramp(0.0, 0.999999 * field * UNIT_FIELD, 1.0)))])
    assert run.at(1.0).stretch[0, 0] == pytest.approx(stretch, rel=3e-3)
    below = run.at(0.5)
    assert forms.dead_load_field(below.stretch[0, 0], prestretch, 110.0) == pytest.approx((0.4999995 * field) ** 2, rel=1e-10)


def test_pure_shear_under_a_field() -> None:
    film = Film(soft, soft, NONE, NONE, EPS)
    held = ("stretch", constant(1.5))
    run = Run(film, [Piece(1.0, (FREE, held), ("field", ramp(0.0, 0.66 * UNIT_FIELD, 1.0)))])
    times = np.array([0.2, 0.7, 1.0])
    wanted = [forms.pure_shear_stretch(0.66 * t, 1.5) for t in times]
    assert run.at(times).stretch[0] == pytest.approx(wanted, rel=1e-12)
    # s_2 of the held axis falls to zero where mu (l2^2 - l3^2) = eps E^2
    times = run.events("loss-of-tension-2")
    assert len(times) == 1
    there = run.at(times)
    assert MU * (1.5**2 - (there.stretch[0] * 1.5) ** -2) == pytest.approx(EPS * there.true_field**2, rel=1e-9)


def test_damage_and_breakdown_of_a_held_film() -> None:
    """Damage under a ramp of the field E = e lp^2: (e_1 lp^2/E_0)^n t^(n+1)/(n+1)/T^n/t_0 = 1; breakdown by a power law."""
    strength, unit, exponent, prestretch, top = 8e7, 3600.0, 18.5, 1.5, 4e7
    film = Film(
        stiffening,
        branch,
        NONE,
        NONE,
        EPS,
        breakdown=lambda l1, l2: 30.6e6 * (l1 * l2) ** (1.13 / 2) * (l1 * l2) ** 0.25,
        damage=(strength, unit, exponent),
    )
    held, period = ("stretch", constant(prestretch)), 1e4
    run = Run(film, [Piece(period, (held, held), ("field", ramp(0.0, top, period)))], rtol=1e-9)
    time = (unit * (exponent + 1)) ** (1 / (exponent + 1)) * (period * strength / (top * prestretch**2)) ** (
        exponent / (exponent + 1)
    )
    assert run.events("damage") == pytest.approx([time], rel=1e-8)
    limit = 30.6e6 * prestretch**1.13 * prestretch**0.5
    assert run.events("breakdown") == pytest.approx([period * limit / prestretch**2 / top], rel=1e-12)


@pytest.mark.parametrize(
    "electric",
    [
        (("field", ramp(0.0, 0.25 * UNIT_FIELD, 5.0)), np.inf),
        (("charge", ramp(0.0, 1.5 * UNIT_CHARGE, 5.0)), np.inf),
        (("source", ramp(0.0, 0.25 * UNIT_FIELD, 5.0)), 2e10),
    ],
)
def test_work_is_stored_or_lost(electric: tuple[Any, float]) -> None:
    """Mechanical and electrical work = energies of springs and dielectric + losses of dashpots and leak, under unequal loads."""
    film = Film(
        lambda l1, l2: mooney_rivlin(l1, l2, 0.4 * MU, 0.1 * MU),
        lambda l1, l2: ogden(l1, l2, (0.9, -0.2), (1.6, -2.8)),
        MODULUS[1:],
        TIME[1:],
        lambda l1, l2: EPS * (1 - 0.05 * (l1 + l2 - 2)),
        leakage=lambda field: 2e-13 * field,
    )
    load = (("stress", ramp(0.0, 2e4, 5.0)), ("stretch", ramp(1.0, 1.4, 5.0)))
    run = Run(film, [Piece(5.0, load, *electric)], rtol=1e-6)
    times = 5.0 * np.linspace(0.0, 1.0, 3001) ** 2
    h = run.at(times)

    def integral(force: np.ndarray, way: np.ndarray) -> float:
        return float(np.sum(0.5 * (force[..., 1:] + force[..., :-1]) * np.diff(way, axis=-1)))

    elastic = h.stretch[:, None] / np.exp(h.log_viscous)
    stored = film.equilibrium(*h.stretch) + film.modulus @ film.branch(*elastic) + 0.5 * h.field * h.charge
    lost = 0.0
    for number, modulus in enumerate(film.modulus):
        log = np.log(elastic[:, number])
        step = 1e-6
        forces = [
            modulus * (film.branch(*np.exp(log + up)) - film.branch(*np.exp(log - up))) / (2 * step)
            for up in step * np.eye(2)[:, :, None]
        ]
        lost += integral(np.stack(forces), h.log_viscous[:, number])
    leaked = integral(film.leakage(h.true_field) * h.true_field, times) if electric[0][0] == "source" else 0.0
    work = integral(h.stress, h.stretch) + integral(h.field, h.charge)
    # the source delivers the charge that leaks as well
    assert work + leaked == pytest.approx(stored[-1] - stored[0] + lost + leaked, rel=1e-5)
    assert lost > 0.05 * work
    assert (leaked > 0) == (electric[0][0] == "source")


def test_the_fold_of_a_frozen_film_is_where_its_stretch_turns_vertical() -> None:
    """The square of the distance to the fold falls in proportion to the time left, and the determinant with its root."""
    film = Film(stiffening, branch, MODULUS[:2], TIME[:2], EPS)
    held, prestretch = ("stretch", constant(1.9)), 1.9
    relaxed = Run(film, [Piece(300.0, (held, held))], rtol=1e-8).final
    assert isinstance(relaxed, State)
    load = (("stress", constant(relaxed.stress[0])), ("stress", constant(relaxed.stress[1])))
    field = 0.32 * UNIT_FIELD
    piece = Piece(100.0, load, ("field", constant(field)))
    state = State(relaxed.log_viscous, relaxed.log_stretch, relaxed.stress)
    end = fold(film, piece, state, rtol=1e-8)
    stretch = float(np.exp(end.log_stretch[0]))
    assert prestretch < stretch < 4
    assert np.ptp(end.log_stretch) < 1e-9
    left = np.array([1e-4, 1e-6]) * end.time
    run = Run(film, [Piece(end.time - left[1], load, ("field", constant(field)))], state, theta=lambda t: 0 * t, rtol=1e-8)
    gap = stretch - run.at(end.time - left).stretch[0]
    assert gap[1] / gap[0] == pytest.approx(0.1, rel=0.1)
    determinant = run.determinant(end.time - left)
    assert (determinant > 0).all()
    assert determinant[1] / determinant[0] == pytest.approx(0.1, rel=0.2)


def test_tolerances_hold() -> None:
    film = Film(stiffening, branch, MODULUS[:2], TIME[:2])
    load = [Piece(2.0, (("stress", ramp(0.0, 5e4, 2.0)), FREE)), Piece(5.0, (("stress", constant(5e4)), FREE))]
    times = np.geomspace(0.01, 7.0, 40)
    loose, tight = (Run(film, load, at_rest(film), rtol=rtol).at(times).stretch[0] for rtol in (1e-5, 1e-7))
    assert loose == pytest.approx(tight, rel=1e-5)
