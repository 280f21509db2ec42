"""Each stage of a step solves the linear system that Rosenbrock methods prescribe, against a dense one with exact derivatives.

The equations are written down here once more, and plainly; their derivatives are taken by complex steps. Systems that are close to
exact would do: the steps' errors would be kept small all the same, by more and shorter steps. So only this tells.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from toys import Eyring

from dielast.material.dielectric import LinearPermittivity
from dielast.material.law import FlowLaw
from dielast.material.laws_of_cases import UNSTRETCHED, LawsOfCases, stretch_laws
from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, Gent, Symmetry
from dielast.mechanics.flow import Flow
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, Load

FREE, HELD = Control.STRESS, Control.STRETCH
SPRINGS, CASES, GAMMA = 4, 3, 0.21
Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Equations = Callable[[complex, Complex], Complex]
COEFFICIENTS = (-0.05, 0.1, 0.0)  # of the permittivity in the stretches, by case
STRESSES = (2e5, None, 1e5)  # of an Eyring flow, by case


def points(random: np.random.Generator, stretching: bool = False, activated: bool = False) -> PointMaterial:
    limits = np.broadcast_to(np.array([[110.0], [55.0], [40.0], [np.inf]]), (SPRINGS, CASES)).copy()
    modulus, rate = random.uniform(2e4, 3e5, (SPRINGS, CASES)), random.uniform(0.01, 3.0, (SPRINGS, CASES))
    rate[0] = 0.0
    permittivity, floor = random.uniform(3e-11, 5e-11, CASES), random.uniform(1.0, 100.0, CASES)
    laws = [LinearPermittivity(1.0, stretch_coefficient=c) for c in COEFFICIENTS]
    dielectrics = stretch_laws(laws, CASES) if stretching else UNSTRETCHED
    flow_laws = LawsOfCases[FlowLaw].of([Eyring(stress) if stress and activated else None for stress in STRESSES], CASES)
    return PointMaterial(modulus, Flow.of(flow_laws, rate, modulus), Gent(limits), permittivity, floor, stretching=dielectrics)


def load(random: np.random.Generator, controls: tuple[Control, Control], electric: bool, constant: bool) -> Load:
    start, rate = np.empty((3, CASES)), np.zeros((3, CASES))
    for axis, control in enumerate(controls):
        start[axis] = random.uniform(1.2, 2.0, CASES) if control is HELD else random.uniform(1e4, 8e4, CASES)
        if not constant:
            rate[axis] = start[axis] * random.uniform(0.1, 0.5, CASES)
    start[2] = random.uniform(1e6, 2e7, CASES) if electric else 0.0
    rate[2] = random.uniform(1e5, 1e6, CASES) if electric and not constant else 0.0
    return Load(controls, start, rate)


def both_axes(material: PointMaterial, ramp: Load, case: int) -> Equations:
    """Rates of x in axis 1 and axis 2 and imbalances of both axes, as functions of time and (x_1, x_2, Lambda or stress)."""
    modulus, rate, limit = material.modulus[:, case], material.flow.fluidity[:, case], np.asarray(material.law.J_lim)[:, case]
    activating = STRESSES[case] if material.flow.depends_on_stress else None
    stressed = [control is FREE for control in ramp.controls]
    coefficient = 0.0 if material.stretching is UNSTRETCHED else COEFFICIENTS[case]

    def equations(time: complex, state: Complex) -> Complex:
        driven = ramp.start[:, case] + ramp.rate[:, case] * time
        (x1, x2), left_open = np.split(state[:-2], 2), state[-2:]
        l1, l2 = (left_open[i] if stressed[i] else 2 * np.log(driven[i]) for i in range(2))
        s1, s2 = (driven[i] if stressed[i] else left_open[i] for i in range(2))
        a, b, c = np.exp(l1 - x1), np.exp(l2 - x2), np.exp(x1 + x2 - l1 - l2)
        phi = 1 / (1 - (a + b + c - 3) / limit)
        p, q = phi * (a - c), phi * (b - c)
        over = 1.0 if activating is None else modulus * np.sqrt(p * p - p * q + q * q) / activating
        flow = rate * (1.0 if activating is None else np.sinh(over) / over)
        squeeze = material.permittivity[case] * (driven[2] * np.exp((l1 + l2) / 2)) ** 2
        stretches = np.exp(np.array((l1, l2)) / 2)
        m1, m2 = squeeze * (1 + coefficient * (stretches[0] + stretches[1] - 2) + 0.5 * coefficient * stretches)
        return np.concatenate(
            (
                flow * (2 * p - q),
                flow * (2 * q - p),
                [modulus @ p - m1 - s1 * np.exp(l1 / 2), modulus @ q - m2 - s2 * np.exp(l2 / 2)],
            )
        )

    return equations


def one_axis(material: PointMaterial, ramp: Load, case: int, symmetry: Symmetry) -> Equations:
    """The same of axis 1 alone, axis 2 following it."""
    full = both_axes(material, ramp, case)
    alike = symmetry is EQUIBIAXIAL

    def equations(time: complex, state: Complex) -> Complex:
        x, left_open = state[:-1], state[-1]
        held = ramp.controls[0] is HELD
        if held:  # axis 2 is as in axis 1, or free
            log_stretch = 2 * np.log(ramp.start[0, case] + ramp.rate[0, case] * time)
            other = left_open if alike else -0.5 * log_stretch
        else:
            other = left_open if alike else -0.5 * left_open
        result = full(time, np.concatenate((x, x if alike else -0.5 * x, [left_open, other])))
        return np.append(result[: len(x)], result[-2])

    return equations


def increment(
    equations: Equations,
    border: int,
    begin: tuple[float, Array],
    stage: tuple[float, Array],
    history: Array,
    h: float,
    gamma_i: float,
) -> Array:
    """u of (M/gamma - h J) u = h f(stage) + M history + h^2 gamma_i df/dt."""
    (time, state), tiny = begin, 1e-30
    jacobian = np.stack(
        [equations(time, state + 1j * tiny * unit).imag / tiny for unit in np.eye(state.size)],
        axis=1,
    )
    in_time = equations(time + 1j * tiny, state.astype(complex)).imag / tiny
    mass = np.append(np.ones(state.size + border), np.zeros(-border))
    right = h * equations(stage[0], stage[1].astype(complex)).real + mass * history + h**2 * gamma_i * in_time
    return np.asarray(np.linalg.solve(np.diag(mass) / GAMMA - h * jacobian, right))


def compare(system: LoadedPoints, border: int, equations: Callable[[int], Equations], seed: int) -> None:
    random = np.random.default_rng(seed)
    rows, (time, h) = SPRINGS * 2 // (3 + border) - border, random.uniform(0.1, 0.3, (2, CASES))
    state = random.uniform(-0.2, 0.2, (rows, CASES))
    for row in range(border, 0):
        stressed = system.load.controls[row - border] is FREE
        state[row] = random.uniform(0.5, 1.0, CASES) if stressed else random.uniform(1e4, 5e4, CASES)
    later, past = state * random.uniform(0.9, 1.1, state.shape), random.uniform(-0.1, 0.1, state.shape)
    linear = system.linearise(np.stack((time, time + 0.5 * h, time + h)), state, h, GAMMA)
    stages = (
        (linear.increment(0, state, None, 0.3, np.empty(state.shape)), time, state, np.zeros_like(past), 0.3),
        (linear.increment(1, later, past, -0.7, np.empty(state.shape)), time + 0.5 * h, later, past, -0.7),
        (linear.increment(2, later, past, 0.0, np.empty(state.shape)), time + h, later, past, 0.0),
    )
    with pytest.raises(AssertionError):  # the increments of the springs are written to another shape of it
        linear.increment(0, state, None, 0.3, np.empty(state.shape, order="F"))
    for found, at, stage, history, gamma_i in stages:
        for case in range(CASES):
            begin, end = (float(time[case]), state[:, case]), (float(at[case]), stage[:, case])
            wanted = increment(equations(case), border, begin, end, history[:, case], float(h[case]), gamma_i)
            np.testing.assert_allclose(found[:border, case], wanted[:border], rtol=1e-9, atol=1e-11)
            stressed = [control is FREE for control in system.load.controls[: system.axes]]
            np.testing.assert_allclose(found[border:, case], np.where(stressed, wanted[border:], 0.0), rtol=1e-9)


@pytest.mark.parametrize("constant", [True, False])
@pytest.mark.parametrize(
    ("electric", "stretching", "activated"),
    [(True, False, False), (True, True, False), (False, False, False), (True, True, True)],
)
@pytest.mark.parametrize("controls", [(FREE, FREE), (FREE, HELD), (HELD, FREE), (HELD, HELD)])
def test_a_stage_with_two_axes(
    controls: tuple[Control, Control], electric: bool, stretching: bool, activated: bool, constant: bool
) -> None:
    random = np.random.default_rng(1)
    material, ramp = points(random, stretching, activated), load(random, controls, electric, constant)
    compare(LoadedPoints(material, ramp), -2, lambda case: both_axes(material, ramp, case), 2)


@pytest.mark.parametrize("constant", [True, False])
@pytest.mark.parametrize(("stretching", "activated"), [(False, False), (True, False), (False, True)])
@pytest.mark.parametrize(
    ("symmetry", "control", "electric"),
    [(UNIAXIAL, FREE, False), (UNIAXIAL, HELD, False), *((EQUIBIAXIAL, c, e) for c in (FREE, HELD) for e in (True, False))],
)
def test_a_stage_with_one(
    symmetry: Symmetry, control: Control, electric: bool, stretching: bool, activated: bool, constant: bool
) -> None:
    random = np.random.default_rng(3)
    material = points(random, stretching, activated)
    ramp = load(random, (control, FREE if symmetry is UNIAXIAL else control), electric, constant)
    for values in (ramp.start, ramp.rate):
        values[1] = 0.0 if symmetry is UNIAXIAL else values[0]
    compare(LoadedPoints(material, ramp, symmetry), -1, lambda case: one_axis(material, ramp, case, symmetry), 4)


@pytest.mark.parametrize("constant", [True, False])
@pytest.mark.parametrize(("symmetry", "control"), [(UNIAXIAL, FREE), (UNIAXIAL, HELD), (EQUIBIAXIAL, FREE), (EQUIBIAXIAL, HELD)])
def test_one_axis_says_what_two_say(symmetry: Symmetry, control: Control, constant: bool) -> None:
    """State, membrane, error: a symmetric state means the same as the one with both axes that it stands for."""
    random = np.random.default_rng(5)
    controls = (control, FREE if symmetry is UNIAXIAL else control)
    material, ramp = points(random), load(random, controls, False, constant)
    for values in (ramp.start, ramp.rate):
        values[1] = 0.0 if symmetry is UNIAXIAL else values[0]
    one, two = LoadedPoints(material, ramp, symmetry), LoadedPoints(material, ramp)
    time = random.uniform(0.0, 1.0, CASES)
    driven = ramp.value(time)
    for scale in (1e-3, 1.0):  # the springs' or the border's part of the error is the largest
        state, change = random.uniform(0.1, 0.9, (2, SPRINGS + 1, CASES))
        if control is HELD:
            state[-1] = 2 * np.log(driven[0])
        change[-1] *= scale
        internal, (log_squared, nominal) = one.internal(state), one.membrane(state, driven)
        np.testing.assert_array_equal(one.pack(internal, log_squared), state)
        whole = two.pack(internal, log_squared)
        np.testing.assert_array_equal(two.internal(whole), internal)
        for mine, theirs in zip(two.membrane(whole, driven), (log_squared, nominal), strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-13, atol=1e-9)
        left_open = np.stack((change[-1], change[-1] if symmetry is EQUIBIAXIAL else -0.5 * change[-1] * (control is FREE)))
        change_of_both = np.concatenate((one.internal(change).reshape(-1, CASES), left_open))
        mine, theirs = one.error(time, state, change), two.error(time, whole, change_of_both)
        if (symmetry, control) == (UNIAXIAL, HELD):  # errors of x of both axes may cancel only where they are one
            assert np.all(mine <= theirs)
        else:
            np.testing.assert_allclose(mine, theirs, rtol=1e-13)
    if symmetry is EQUIBIAXIAL:
        softening, both = points(random, stretching=True), np.repeat(state[-1:], 2, axis=0)
        stress, slope, by_load = softening.maxwell_tangent(both, np.full(CASES, 2e7))
        of_one = stress[:1], slope[:1].sum(axis=1, keepdims=True), by_load[:1]
        for mine, theirs in zip(softening.maxwell_tangent(state[-1:], np.full(CASES, 2e7)), of_one, strict=True):
            assert mine == pytest.approx(theirs, rel=1e-14)
