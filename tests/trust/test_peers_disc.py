"""The disc peer: shooting, the semi-discrete film, closed forms, the membrane peer, and the balance of energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from peers import closed_forms as forms
from peers.disc import DiscRun, Drive, creep_compliance, disc, free_disc, graded, shoot, small_strain, strip
from peers.energies import gent, stress
from peers.membrane import Film, Piece, Run, State, constant, ramp
from scipy.optimize import brentq

pytestmark = pytest.mark.trust

NONE = np.zeros(0)
MODULUS, TIME = np.array([1.0, 2.0]), np.array([10.0, 0.1])  # over the equilibrium spring's; s
RHO, PRESTRETCH = 1 / 3, 3.0
FRAME = (constant(PRESTRETCH),)


def spring(l1: Any, l2: Any) -> Any:
    return gent(l1, l2, 1.0, 110.0)


def branch(l1: Any, l2: Any) -> Any:
    return gent(l1, l2, 1.0, 55.0)


ELASTIC, VISCOUS = Film(spring, spring, NONE, NONE), Film(spring, branch, MODULUS, TIME)


def settled(film: Film, elements: int, field: float) -> float:
    """Stretch of the semi-discrete disc to which prestretch and then a field are applied at once."""
    drives = [Drive(0.0, FRAME), Drive(0.0, FRAME, constant(field))]
    return float(DiscRun(film, disc(graded(RHO, elements)), drives).final.u[0])


@pytest.mark.parametrize(
    ("relative", "stated"), [(1.02, 0.080869), (1.1, 0.163110), (1.2, 0.205489), (1.3, 0.227181), (1.5, 0.247665)]
)
def test_the_elastic_disc_by_shooting(relative: float, stated: float) -> None:
    squared, profile = shoot(spring, PRESTRETCH, RHO, relative * PRESTRETCH)
    assert np.sqrt(squared) == pytest.approx(stated, abs=5.01e-7)
    l1, l2, s1, s2 = profile([1.0, 1 / RHO])
    assert l2 == pytest.approx([relative * PRESTRETCH, PRESTRETCH], rel=1e-10)
    x = relative * PRESTRETCH
    assert s1[0] == pytest.approx((forms.equibiaxial_stress(x, 110.0) - squared * x**4) / x, rel=1e-10)
    assert np.stack((s1, s2)) == pytest.approx(stress(spring, l1, l2), rel=1e-12)


def test_the_semi_discrete_disc_converges_to_it_with_the_square_of_the_mesh() -> None:
    squared, _ = shoot(spring, PRESTRETCH, RHO, 1.3 * PRESTRETCH)
    errors = np.array([settled(ELASTIC, elements, np.sqrt(squared)) - 1.3 * PRESTRETCH for elements in (5, 10, 20, 40)])
    assert errors[:-1] / errors[1:] == pytest.approx(np.full(3, 4.0), rel=0.05)
    assert abs(errors[-1] + (errors[-1] - errors[-2]) / 3) < 0.01 * abs(errors[-1])  # and so does its extrapolation, faster


def test_profiles_agree() -> None:
    squared, profile = shoot(spring, PRESTRETCH, RHO, 1.2 * PRESTRETCH)
    structure = disc(graded(RHO, 80))
    run = DiscRun(ELASTIC, structure, [Drive(0.0, FRAME), Drive(0.0, FRAME, constant(np.sqrt(squared)))])
    there = run.at(0.0)
    last = run.parts[-1].at(0.0)
    assert there.stretch[0, :, 0] == pytest.approx(np.full(81, PRESTRETCH), rel=1e-12)
    wanted = profile(structure.radius[1:])
    assert last[0][:, 1:] == pytest.approx(wanted[:2], rel=1e-4)
    assert last[1][:, 1:] == pytest.approx(wanted[2:], rel=1e-4)


@pytest.mark.parametrize("rho", [0.05, 1 / 3, 0.8])
def test_small_strains_are_the_closed_form(rho: float) -> None:
    field = 1e-3
    strain = small_strain(1.0, 1.0, field, rho)
    assert strain == forms.framed_small_strain(field, rho)
    squared, _ = shoot(spring, 1.0, rho, 1 + strain)
    assert squared == pytest.approx(field**2, rel=1e-5)
    structure = disc(graded(rho, 200))
    run = DiscRun(ELASTIC, structure, [Drive(0.0, (constant(1.0),), constant(field))])
    assert run.final.u[0] - 1 == pytest.approx(strain, rel=1e-3)


def test_small_strains_creep_with_the_compliance() -> None:
    """The elastic strain with the creep compliance in place of 1/mu (correspondence principle): (1 - rho^2) eps e^2 J(t)/8."""
    field, times = 1e-2, np.array([0.01, 0.1, 1.0, 10.0, 100.0])
    compliance = creep_compliance(1.0, MODULUS, TIME, times)
    assert creep_compliance(1.0, MODULUS, TIME, [0.0, 1e4]) == pytest.approx([0.25, 1.0], rel=1e-9)
    strains = [
        DiscRun(VISCOUS, disc(graded(RHO, elements)), [Drive(100.0, (constant(1.0),), constant(field))], rtol=1e-6, atol=1e-11)
        .at(times)
        .u[0]
        - 1
        for elements in (8, 16)
    ]
    extrapolated = (4 * strains[1] - strains[0]) / 3
    assert extrapolated == pytest.approx((1 - RHO**2) * field**2 * compliance / 8, rel=2e-4)


def test_a_viscoelastic_disc_begins_with_all_springs_and_ends_with_one() -> None:
    def all_springs(l1: Any, l2: Any) -> Any:
        return spring(l1, l2) + MODULUS.sum() * branch(l1, l2)

    relative, elements = 1.1, 20
    at_once, _ = shoot(all_springs, PRESTRETCH, RHO, relative * PRESTRETCH)
    assert settled(VISCOUS, elements, np.sqrt(at_once)) == pytest.approx(relative * PRESTRETCH, rel=2e-5)
    at_last, _ = shoot(spring, PRESTRETCH, RHO, relative * PRESTRETCH)
    drives = [Drive(0.0, FRAME), Drive(1e4, FRAME, constant(np.sqrt(at_last)))]
    run = DiscRun(VISCOUS, disc(graded(RHO, elements)), drives, rtol=1e-5)
    elastic = settled(ELASTIC, elements, np.sqrt(at_last))
    assert run.final.u[0] == pytest.approx(elastic, rel=1e-7)
    assert elastic == pytest.approx(relative * PRESTRETCH, rel=1e-5)


def test_prestretch_and_relaxation_are_homogeneous_and_the_membranes() -> None:
    course = ramp(1.0, 2.0, 2.0)
    there = Run(VISCOUS, [Piece(2.0, (("stretch", course), ("stretch", course)))], rtol=1e-8).at([0.5, 2.0])
    here = DiscRun(VISCOUS, disc(graded(0.2, 8)), [Drive(2.0, (course,))]).at([0.5, 2.0])
    assert here.stretch == pytest.approx(np.broadcast_to(there.stretch[:, None], here.stretch.shape), rel=1e-8)
    assert here.stress == pytest.approx(np.broadcast_to(there.stress[:, None], here.stress.shape), rel=1e-7)


def test_a_disc_with_a_free_rim_is_the_membrane_under_dead_load_and_pulls_in_with_it() -> None:
    held, prestretch, field = ("stretch", constant(1.9)), 1.9, 0.28
    relaxed = Run(VISCOUS, [Piece(30.0, (held, held))], rtol=1e-8).final
    load, drive = float(relaxed.stress[0]), ramp(0.0, field, 1.0)
    dead = ("stress", constant(load))
    state = State(relaxed.log_viscous, relaxed.log_stretch, relaxed.stress)
    pieces = [Piece(1.0, (dead, dead), ("field", drive)), Piece(4.0, (dead, dead), ("field", constant(field)))]
    frame = (constant(1.0),)
    moment = DiscRun(VISCOUS, free_disc(), [Drive(0.0, frame)]).final
    moment = type(moment)(np.array([prestretch]), relaxed.log_viscous[:, :, None], np.ones(1), 0.0, load)
    drives = [Drive(1.0, frame, drive, constant(load)), Drive(4.0, frame, constant(field), constant(load))]
    watch, rtol = ramp(0.0, 1.0, 1.0), 1e-7
    there = Run(VISCOUS, pieces, state, theta=watch, rtol=rtol)
    here = DiscRun(VISCOUS, free_disc(), drives, moment, theta=watch, rtol=rtol)
    times = np.array([0.2, 1.0, 2.0, 4.0, 5.0])
    assert here.at(times).u[0] == pytest.approx(there.at(times).stretch[0], rel=3e-7)
    # d2Pi/dl2 = 2 (ds_1/dl_1 + ds_1/dl_2), the factor of the determinant that falls to zero
    determinant, eigenvalue = there.determinant(times), here.eigenvalue(times)
    assert (np.sign(determinant) == np.sign(eigenvalue)).all()
    (pull_in,) = there.events("pull-in")
    assert list(np.sign(here.eigenvalue(pull_in * np.array([1 - 1e-6, 1 + 1e-6])))) == [1.0, -1.0]


def test_a_frame_close_by_is_a_clamp() -> None:
    squared, _ = shoot(spring, PRESTRETCH, 0.999, PRESTRETCH * (1 + 1e-4))
    assert squared > 100 * shoot(spring, PRESTRETCH, RHO, PRESTRETCH * (1 + 1e-4))[0]
    drives = [Drive(0.0, FRAME), Drive(0.0, FRAME, constant(0.2))]
    moved = [DiscRun(ELASTIC, disc(graded(rho, 4)), drives).final.u[0] / PRESTRETCH - 1 for rho in (0.99, 0.999)]
    assert moved[1] == pytest.approx(moved[0] / 10, rel=0.1)


def test_a_disc_without_load_is_stable_and_its_tangent_symmetric() -> None:
    run = DiscRun(VISCOUS, disc(graded(RHO, 6)), [Drive(1.0, (ramp(1.0, 2.0, 1.0),))])
    assert (run.eigenvalue([0.0, 0.5, 1.0]) > 0).all()
    log = np.log(run.at(1.0).stretch[..., 0])
    matrix = run.assembly.stiffness(log, run.final.log_viscous, 0.1).toarray()
    assert matrix == pytest.approx(matrix.T, rel=1e-12)
    assert np.count_nonzero(np.triu(matrix, 2)) == 0


def test_events_of_a_framed_disc() -> None:
    """The disc breaks down; the film around it goes slack at its rim first."""
    film = Film(spring, branch, MODULUS, TIME, breakdown=2.5)
    course = ramp(0.0, 0.4, 10.0)
    run = DiscRun(film, disc(graded(RHO, 8)), [Drive(0.0, FRAME), Drive(10.0, FRAME, course)], rtol=1e-6)
    (broken,), (slack,) = run.events("breakdown"), run.events("loss-of-tension-1")
    assert course(broken) * run.at(broken).u[0, 0] ** 2 == pytest.approx(2.5, rel=1e-9)
    there = run.at(slack).stress[0, 1:, 0]
    assert there[0] == pytest.approx(0.0, abs=1e-9)
    assert (there[1:] > 0).all()
    assert (run.eigenvalue([0.0, 1.0]) > 0).all()


def test_electrical_work_is_stored_or_lost_over_the_whole_film() -> None:
    """The frame does no work; the disc's charge is e l^4 times its undeformed area."""
    structure = disc(graded(RHO, 8))
    course = ramp(0.0, 0.25, 5.0)
    run = DiscRun(VISCOUS, structure, [Drive(0.0, FRAME), Drive(5.0, FRAME, course)], rtol=1e-7)
    times = 5.0 * np.linspace(0.0, 1.0, 801) ** 2
    part = run.parts[1]
    values = [part.at(t) for t in times]
    stretch, u, x, field = (np.stack([value[i] for value in values], axis=-1) for i in (0, 2, 3, 4))
    weight = structure.weight[:, None]
    elastic = stretch[:, None] / np.exp(x)
    springs = spring(*stretch) + np.einsum("n,npt->pt", MODULUS, branch(*elastic))
    charge = field * u[0] ** 4
    stored = (weight * springs).sum(axis=0) + 0.5 * field * charge
    force = MODULUS[:, None, None] * elastic * stress(branch, *elastic)
    middle, way = 0.5 * (force[..., 1:] + force[..., :-1]), np.diff(x, axis=-1)
    lost = float((weight * (middle * way).sum(axis=(0, 1))).sum())
    # what the film stored in its prestretch flows, too
    work = float(np.sum(0.5 * (field[1:] + field[:-1]) * np.diff(charge)))
    assert work == pytest.approx(stored[-1] - stored[0] + lost, abs=2e-5 * lost)
    assert lost > work > 0


def test_an_elastic_strip() -> None:
    """f l_a + (1 - f) l_p = lp1 and S1 alike in both parts, by root finding."""
    share, frame, field = 0.4, (2.0, 1.5), 0.3
    run = DiscRun(
        ELASTIC,
        strip(share),
        [
            Drive(0.0, (constant(frame[0]), constant(frame[1]))),
            Drive(0.0, (constant(frame[0]), constant(frame[1])), constant(field)),
        ],
    )

    def difference(active: float) -> float:
        passive = (frame[0] - share * active) / (1 - share)
        pull = [stress(spring, np.array([x]), np.array([frame[1]]))[0, 0] for x in (active, passive)]
        return float(pull[0] - field**2 * active * frame[1] ** 2 - pull[1])

    assert run.final.u[0] == pytest.approx(brentq(difference, frame[0], 4.0, xtol=1e-14), rel=1e-12)


def test_a_strip_with_a_small_active_part_is_a_dead_load_and_with_a_large_one_a_clamp() -> None:
    frame, field = (constant(2.0), constant(1.5)), constant(0.2)
    held = (("stretch", constant(2.0)), ("stretch", constant(1.5)))
    relaxed = Run(VISCOUS, [Piece(1e4, held)], rtol=1e-7).final  # at rest, so that the passive part's pull is constant
    state = State(relaxed.log_viscous, relaxed.log_stretch, relaxed.stress)
    dead = (("stress", constant(float(relaxed.stress[0]))), held[1])
    times = np.array([0.01, 1.0, 30.0])
    wanted = Run(VISCOUS, [Piece(30.0, dead, ("field", field))], state, rtol=1e-8).at(times).stretch[0]
    for share, limit, within in ((1e-7, wanted, 2e-6), (1 - 1e-7, np.full(3, 2.0), 2e-6)):
        structure = strip(share)
        moment = DiscRun(VISCOUS, structure, [Drive(0.0, frame)]).final
        moment = type(moment)(moment.u, np.repeat(relaxed.log_viscous[:, :, None], 2, axis=2), moment.frame)
        run = DiscRun(VISCOUS, structure, [Drive(30.0, frame, field)], moment, rtol=1e-7)
        assert run.at(times).u[0] == pytest.approx(limit, rel=within)
