"""Laws of springs against independent energies, their limits, and where they are stable."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import pytest
from peers import energies
from peers.energies import inverse_langevin

from dielast.base.errors import DielastWarning, InputError
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import (
    EQUIBIAXIAL,
    UNIAXIAL,
    ArrudaBoyce,
    Gent,
    GentI2,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    SpringLaw,
    Yeoh,
    gathered,
)
from dielast.material.springs.arruda_boyce import chain_energy, inverse
from dielast.material.springs.stable_range import free_axis_holds, stable_range, tension_rises
from dielast.material.use_checks import warn_of_instability

MU, ALPHA = (18e3, -2e3, 40.0), (1.6, -2.5, 5.0)
LAWS: list[tuple[SpringLaw, Callable[[Any, Any], Any]]] = [
    (Yeoh(13e3, -150.0, 2.0), lambda l1, l2: energies.yeoh(l1, l2, 13e3, -150.0, 2.0)),
    (ArrudaBoyce(6.0), lambda l1, l2: energies.arruda_boyce(l1, l2, 1.0, 6.0)),
    (MooneyRivlin(11e3, 2e3), lambda l1, l2: energies.mooney_rivlin(l1, l2, 11e3, 2e3)),
    (Ogden(MU, ALPHA), lambda l1, l2: energies.ogden(l1, l2, MU, ALPHA)),
    (GentI2(90.0, 0.4, 0.9), lambda l1, l2: energies.gent_i2(l1, l2, 0.6, 90.0, 0.4, 0.9)),
    (GentI2(90.0, 0.3), lambda l1, l2: energies.gent_i2(l1, l2, 0.7, 90.0, 0.3, 0)),
    (Gent(55.0), lambda l1, l2: energies.gent(l1, l2, 1.0, 55.0)),
    (Gent(), lambda l1, l2: energies.neo_hookean(l1, l2, 1.0)),
    (NeoHookean(), lambda l1, l2: energies.neo_hookean(l1, l2, 1.0)),
]
NEO_HOOKEAN = [
    (Yeoh(3.0), 1e-15),
    (ArrudaBoyce(), 1e-15),
    (ArrudaBoyce(1e9), 1e-15),
    (ArrudaBoyce(1e3), 1e-4),
    (MooneyRivlin(3.0), 1e-15),
    (MooneyRivlin(3.0, 0.0), 1e-15),
    (Ogden((2.0,), (2.0,)), 1e-14),
    (Ogden((2.0, 1.0, 0.0), (2.0, 2.0, -3.0)), 1e-14),
    (GentI2(), 1e-15),
    (GentI2(1e18, 0.0, 0.7), 1e-15),
    (Gent(1e14), 1e-12),
]
IDS = [f"{law.name}-{k}" for k, (law, _) in enumerate(LAWS)]
STRETCHES = np.exp(np.random.default_rng(1).uniform(-0.7, 1.1, (2, 500)))
MODES = ("uniaxial", "equibiaxial", "pure-shear")


@pytest.mark.parametrize(("law", "energy"), LAWS, ids=IDS)
def test_stress_tangent_and_energy_are_those_of_the_energy(law: SpringLaw, energy: Callable[[Any, Any], Any]) -> None:
    modulus, (l1, l2) = law.initial_modulus() or 1.0, STRETCHES
    expected = energies.stress(energy, l1, l2) * STRETCHES / modulus
    stress, half = law.tangent(STRETCHES**2)
    assert stress == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert law.stress(STRETCHES**2) == pytest.approx(stress, rel=1e-14, abs=1e-14)
    matrix = energies.tangent(energy, l1, l2) / modulus
    # d p_i/d ln l_j = l_i l_j d2W/dl_i dl_j + p_i delta_ij, twice the derivatives in ln A and ln B
    assert 2 * half[0] == pytest.approx(matrix[0, 0] * l1 * l1 + expected[0], rel=1e-9)
    assert 2 * half[1] == pytest.approx(matrix[0, 1] * l1 * l2, rel=1e-9)
    assert 2 * half[2] == pytest.approx(matrix[1, 1] * l2 * l2 + expected[1], rel=1e-9)
    assert law.energy(STRETCHES**2) == pytest.approx(energy(l1, l2) / modulus, rel=1e-9, abs=1e-13)


@pytest.mark.parametrize(("law", "energy"), LAWS, ids=IDS)
def test_the_short_forms_of_symmetric_loads_are_the_same(law: SpringLaw, energy: Callable[[Any, Any], Any]) -> None:
    front = STRETCHES[0] ** 2
    for symmetry in (UNIAXIAL, EQUIBIAXIAL):
        thickness, both = front**-symmetry.thinning, np.stack((front, front**symmetry.second))
        stress, half = law.tangent(both)
        slope = half[0] + symmetry.second * half[1]
        assert law.axial_stress(symmetry, front.copy(), thickness.copy()) == pytest.approx(stress[0], rel=1e-12, abs=1e-13)
        found = law.axial_tangent(symmetry, front.copy(), thickness.copy())
        assert found[0] == pytest.approx(stress[0], rel=1e-12, abs=1e-13)
        assert found[1] == pytest.approx(slope, rel=1e-12)
        if symmetry is UNIAXIAL:
            assert stress[1] == pytest.approx(0.0, abs=1e-12 * np.max(np.abs(stress)))
    _, half = law.tangent(np.stack((front, front)))
    own, both_axes = law.equibiaxial_tangent(front.copy())
    assert own == pytest.approx(half[0] - half[1], rel=1e-12)
    assert both_axes == pytest.approx(half[1], rel=1e-12)


@pytest.mark.parametrize(("law", "within"), NEO_HOOKEAN)
def test_every_law_is_neo_hookean_in_its_limit(law: SpringLaw, within: float) -> None:
    squared, known = STRETCHES**2, NeoHookean()
    (stress, half), (expected, slope) = law.tangent(squared), known.tangent(squared)
    assert stress == pytest.approx(expected, rel=within, abs=100 * within)
    assert half == pytest.approx(slope, rel=100 * within)
    assert law.energy(squared) == pytest.approx(known.energy(squared), rel=100 * within, abs=2e-14)


@pytest.mark.parametrize("law", [law for law, _ in LAWS], ids=IDS)
def test_the_initial_modulus_is_one_and_constants_scale(law: SpringLaw) -> None:
    assert law.tangent(np.ones((2, 1)))[1][:, 0] == pytest.approx([2.0, 1.0, 2.0], rel=1e-14)
    assert law.energy(np.ones((2, 1))) == pytest.approx(0.0, abs=1e-15)
    idle = law.unlimited().tangent(STRETCHES**2)
    assert idle[0] == pytest.approx(NeoHookean().stress(STRETCHES**2), rel=1e-13, abs=1e-13)
    assert {name: np.shape(value) for name, value in law.unlimited().values().items()} == {
        name: np.shape(value) for name, value in law.values().items()
    }
    if isinstance(law, Yeoh | MooneyRivlin | Ogden):
        other = law.of_modulus(1e6)
        assert other.initial_modulus() == pytest.approx(1e6, rel=1e-15)
        assert other.stress(STRETCHES**2) == pytest.approx(law.stress(STRETCHES**2), rel=1e-14, abs=1e-14)
        assert other.shape() == law.shape()


def test_ogden_with_2_and_minus_2_is_mooney_rivlin() -> None:
    one, other = MooneyRivlin(11e3, 2e3), Ogden((22e3, -4e3), (2.0, -2.0))
    assert other.initial_modulus() == one.initial_modulus() == 26e3
    assert other.tangent(STRETCHES**2)[1] == pytest.approx(one.tangent(STRETCHES**2)[1], rel=1e-13)
    assert other.stress(STRETCHES**2) == pytest.approx(one.stress(STRETCHES**2), rel=1e-12, abs=1e-13)


def test_gent_i2_is_gent_and_mooney_rivlin_in_its_limits() -> None:
    squared = STRETCHES**2
    for one, other in (
        (GentI2(90.0), Gent(90.0)),
        (GentI2(math.inf, 0.4, 1.0), MooneyRivlin(0.6, 0.4)),
        (GentI2(1e17, 0.4, 1.0), MooneyRivlin(0.6, 0.4)),
        (GentI2(90.0, 0.4, 1e-12), GentI2(90.0, 0.4)),
    ):
        (stress, half), (expected, slope) = one.tangent(squared), other.tangent(squared)
        assert stress == pytest.approx(expected, rel=1e-10, abs=1e-12)
        assert half == pytest.approx(slope, rel=1e-10)
        assert one.energy(squared) == pytest.approx(other.energy(squared), rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("m", [0.0, 0.4, 0.9, 1.0, 1.5])
def test_the_second_term_of_gent_i2_alone_in_closed_form(m: float) -> None:
    """Equal-biaxial: s = mu2 (I2/3)^(m - 1) (l^3 - l^-3), I2 = 2 l^-2 + l^4; uniaxial: mu2 (I2/3)^(m - 1) (1 - l^-3), I2 = 2 l +
    l^-2.
    """
    stretch, law = np.linspace(0.6, 4.0, 30), GentI2(math.inf, 1.0, m)
    both = law.stress(np.stack((stretch, stretch)) ** 2)
    second = (2 * stretch**-2 + stretch**4) / 3
    assert both / stretch == pytest.approx(np.stack([second ** (m - 1) * (stretch**3 - stretch**-3)] * 2), rel=1e-12, abs=1e-13)
    p, q = law.stress(np.stack((stretch, stretch**-0.5)) ** 2)
    second = (2 * stretch + stretch**-2) / 3
    assert p / stretch == pytest.approx(second ** (m - 1) * (1 - stretch**-3), rel=1e-12, abs=1e-13)
    assert q == pytest.approx(0.0, abs=1e-13)


def test_gent_i2_is_stable_until_its_second_term_softens() -> None:
    """Logarithm alone, uniaxial: s = 3 (l - l^-2)/(2 l^2 + 1/l), whose maximum is the end; with m = 1 there is none."""
    end = stable_range(GentI2(math.inf, 1.0), "uniaxial")[1]

    def stress(l1: complex) -> complex:
        return 3 * (l1 - l1**-2) / (2 * l1**2 + 1 / l1)

    assert np.imag(stress(end + 1e-30j)) / 1e-30 == pytest.approx(0.0, abs=1e-9)
    assert stable_range(GentI2(math.inf, 0.5, 1.0), "equibiaxial") == (0.0, math.inf)
    assert stable_range(GentI2(50.0, 0.1, 1.0), "equibiaxial")[1] == pytest.approx(stable_range(Gent(50.0), "equibiaxial")[1])


def test_the_inverse_langevin_function_is_right_to_rounding() -> None:
    """Against Newton's method on numbers of 60 digits, L(b) = 1 + 2/(exp(2 b) - 1) - 1/b."""
    with localcontext() as context:
        context.prec = 60
        for start in (1e-8, 1e-3, 0.3, 1.0, 1.7, 2.6, 3.99, 4.01, 4.3, 4.4, 4.5, 9.0, 40.0, 900.0):
            b = Decimal(start)
            y = float(1 + 2 / ((2 * b).exp() - 1) - 1 / b)
            for _ in range(6):
                growth = (2 * b).exp()
                slope = 1 / b**2 - 4 * growth / (growth - 1) ** 2
                b -= (1 + 2 / (growth - 1) - 1 / b - Decimal(y)) / slope
            exact = float(b), float(b / Decimal(y)), float(1 / slope)
            condition = float(Decimal(y) / slope / b)  # a rounding of y, relative, makes so large a one of b
            rounding = 8 * condition * np.finfo(float).eps
            assert [float(value[0]) for value in inverse(np.array([y]))] == pytest.approx(exact, rel=max(rounding, 4e-15))
            energy = float(Decimal(y) * b - (((b.exp() - (-b).exp()) / 2) / b).ln())
            assert float(chain_energy(np.array([y]))[0]) == pytest.approx(energy, rel=max(rounding, 4e-15))


def test_the_inverse_langevin_function_at_its_ends() -> None:
    b, ratio, slope = inverse(np.array([0.0, 1.0, 1.5]))
    assert b.tolist() == [0.0, np.inf, np.inf]
    assert ratio.tolist()[1:] == slope.tolist()[1:] == [np.inf, np.inf]
    assert (ratio[0], slope[0]) == pytest.approx((3.0, 3.0), rel=1e-15)
    y = np.linspace(1e-3, 0.999, 2000)
    assert inverse(y)[0] == pytest.approx(inverse_langevin(y), rel=1e-12)


def test_arruda_boyce_ends_at_its_locking_stretch() -> None:
    law = ArrudaBoyce(3.0)
    front = np.array([25.0, 27.0, 40.0])
    squared = np.stack((front, 1 / np.sqrt(front)))
    margin = law.margin(squared)
    assert margin[0] > 0 > margin[2]
    with np.errstate(invalid="ignore"):
        assert np.isinf(law.stress(squared)[0, 2])
    assert np.isinf(law.energy(squared)[2])
    low, high = stable_range(law, "uniaxial")
    assert high**2 + 2 / high == pytest.approx(27.0, rel=1e-9)
    assert low**2 + 2 / low == pytest.approx(27.0, rel=1e-9)


@pytest.mark.parametrize("mode", MODES)
def test_laws_that_never_soften_are_stable_everywhere(mode: str) -> None:
    for law in (NeoHookean(), Gent(), ArrudaBoyce(), MooneyRivlin(1.0, 0.2), Ogden((1.0,), (2.0,)), Yeoh(1.0, 0.1, 0.0)):
        assert stable_range(law, mode) == (0.0, np.inf)
    law = Gent(50.0)
    high = stable_range(law, mode)[1]
    fronts = {"uniaxial": high**2 + 2 / high, "equibiaxial": 2 * high**2 + high**-4, "pure-shear": high**2 + 1 + high**-2}
    assert fronts[mode] == pytest.approx(53.0, rel=1e-9)


@pytest.mark.parametrize(("mode", "end"), [("uniaxial", 2.5 ** (4 / 3)), ("equibiaxial", 4 ** (2 / 3)), ("pure-shear", 3.0)])
def test_the_maximum_of_tension_of_a_soft_spring(mode: str, end: float) -> None:
    """Ogden's alpha = 1/2: s = l^(-1/2) - l^(-5/4), l^(-1/2) - l^-2 and l^(-1/2) - l^(-3/2), times a constant."""
    law = Ogden((4.0,), (0.5,))
    low, high = stable_range(law, mode)
    assert (low, high) == (0.0, pytest.approx(end, rel=1e-9))
    second = {"uniaxial": -0.5, "equibiaxial": 1.0, "pure-shear": 0.0}[mode]
    at = np.array([0.99 * end, 1.01 * end])
    squared = np.stack((at, at**second)) ** 2
    assert tension_rises(law, squared, mode).tolist() == [True, False]
    material = Material("soft", 26e3, Spectrum(np.array([1.0]), np.array([1e4])), NoShift(20.0), law, law)
    warn_of_instability(material, np.sqrt(squared[:, :1]), mode)
    with pytest.warns(DielastWarning, match=rf"the Ogden law of the equilibrium spring is unstable.* below {end:.4g} only"):
        warn_of_instability(material, np.sqrt(squared), mode)


def test_a_free_axis_may_be_unstable_while_the_tension_rises() -> None:
    """Mooney-Rivlin with C01 < 0 in uniaxial tension: d2W/d(ln l2)^2 = 8 (C10/l + C01 l) vanishes at l = sqrt(-C10/C01), and s =
    2 (l - l^-2) (C10 + C01/l) still rises there.
    """
    c10, c01 = 15.0, -2.0
    law, end = MooneyRivlin(c10, c01), np.sqrt(-c10 / c01)
    assert stable_range(law, "uniaxial")[1] == pytest.approx(end, rel=1e-9)
    at = end * np.array([0.99, 1.01])
    assert np.diff(2 * (at - at**-2.0) * (c10 + c01 / at))[0] > 0
    stretch = np.stack((at, at**-0.5))
    assert free_axis_holds(law, stretch**2, "uniaxial").tolist() == [True, False]
    assert free_axis_holds(law, stretch**2, "pure-shear").all()
    material = Material("soft", 26e3, Spectrum(np.array([1.0]), np.array([1e4])), NoShift(20.0), law, law)
    with pytest.warns(DielastWarning, match="unstable: its free axis is at no minimum of the energy.* below 2.739 only") as caught:
        warn_of_instability(material, stretch, "uniaxial")
    assert "tension falls" not in str(caught[0].message)


def test_a_soft_yeoh_spring_falls_where_its_slope_vanishes() -> None:
    """s = 2 (l - 1/l^2) (C10 + 2 C20 x) in uniaxial tension: the end is a root of ds/dl."""
    law = Yeoh(1.0, -0.02)
    stretch = stable_range(law, "uniaxial")[1]

    def stress(l1: complex) -> complex:
        return 2 * (l1 - l1**-2) * (1 - 0.04 * (l1**2 + 2 / l1 - 3))

    assert np.imag(stress(stretch + 1e-30j)) / 1e-30 == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MooneyRivlin(-2.0, 1.0), r"the initial shear modulus 2 \(C10 \+ C01\) is -2 Pa: it must be positive"),
        (lambda: Ogden((1.0,), (-2.0,)), r"the initial shear modulus sum mu_p alpha_p / 2 is -1 Pa"),
        (lambda: Ogden((1.0, 2.0), (2.0,)), "2 mu but 1 alpha"),
        (lambda: Ogden((1.0,), (0.0,)), "alpha: 0: an exponent from -50 to 50 other than 0"),
        (lambda: Ogden((1.0,), (np.nan,)), "every constant must be finite"),
        (lambda: Yeoh(0.0, 1.0), "the initial shear modulus 2 C10 is 0 Pa"),
        (lambda: ArrudaBoyce(1.0), "locking_stretch: 1: above 1 is needed"),
        (lambda: GentI2(90.0, 1.2), "I2_share: 1.2: the share of the second term is needed, from 0 to 1"),
        (lambda: GentI2(90.0, 0.2, np.inf), "I2_exponent: a finite exponent"),
        (lambda: GentI2(-1.0, 0.2), "J_lim: -1: the value of I1 - 3"),
        (lambda: ArrudaBoyce(np.nan), "locking_stretch: nan: above 1 is needed"),
    ],
)
def test_wrong_constants_are_refused(make: Callable[[], SpringLaw], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_beyond_the_limit_of_gent_nothing_is_finite() -> None:
    beyond = np.array([[36.0], [36.0]])
    with np.errstate(divide="ignore"):
        assert not np.isfinite(Gent(55.0).stress(beyond)).any()
    assert np.isinf(Gent(55.0).energy(beyond)).all()
    assert Gent(55.0).largest_invariant() == 58.0


def test_one_invariant_is_as_good_as_many() -> None:
    for law in (Gent(), Gent(110.0), Gent(55.0)):
        many = np.array([3.0, 5.0, 40.0])
        for k, one in enumerate(many):
            invariant = np.array(one)
            assert law.stiffness(invariant) == law.stiffness(one) == law.stiffness(many)[k]
            assert law.hardening(invariant) == (law.hardening(many)[0][k], law.hardening(many)[1][k])
            assert law.energy_of(invariant) == law.energy_of(many)[k]
        assert many.tolist() == [3.0, 5.0, 40.0]


def test_terms_of_ogden_stand_beside_cases() -> None:
    laws = [(Ogden((1.0, -0.1 * k), (1.6, -2.5)), Ogden((1.0, -0.2), (1.4 + 0.1 * k, -2.0))) for k in range(1, 4)]
    law = gathered(laws, np.array([[True] * 3, [True, False, True]]))  # type: ignore[arg-type]
    assert isinstance(law, Ogden)
    squared = np.random.default_rng(0).uniform(0.5, 3.0, (2, 2, 3))
    for case, (first, rest) in enumerate(laws):
        assert law.stress(squared)[:, 0, case] == pytest.approx(first.stress(squared[:, :1, case])[:, 0], rel=1e-14)
        carries = rest if case != 1 else NeoHookean()
        assert law.stress(squared)[:, 1, case] == pytest.approx(carries.stress(squared[:, 1:, case])[:, 0], rel=1e-13)
        assert law.of_spring(0, case).values()["alpha"].tolist() == [1.6, -2.5]


@pytest.mark.parametrize("law", [Gent(80.0), *(law for law, _ in LAWS)], ids=lambda law: law.name)
def test_selected_cases_have_the_law_of_their_constants(law: SpringLaw) -> None:
    rng, cases = np.random.default_rng(2), np.array([2, 0, 2, 4])
    other = law.with_values({name: np.asarray(value) * 1.01 for name, value in law.values().items()})
    several = gathered([(law, other) if case % 2 else (other, law) for case in range(5)], np.ones((3, 5), dtype=bool))
    selected, squared = several.take(cases), rng.uniform(0.8, 1.6, (2, 3, 4))
    again = several.with_values({name: value.take(cases, axis=-1) for name, value in several.arrays().items()})
    for found, exact in zip(selected.tangent(squared), again.tangent(squared), strict=True):
        assert np.array_equal(found, exact)
    for case, stated in enumerate(cases.tolist()):
        alone = law if stated % 2 else other
        assert selected.stress(squared)[:, 0, case] == pytest.approx(alone.stress(squared[:, :1, case])[:, 0], rel=1e-13)
    solid = gathered([(law, other), (law, law)], np.ones((2, 2), dtype=bool))  # one law, beside branches that differ
    assert solid.stress(squared[:, :2, :2])[:, 1, 1] == pytest.approx(law.stress(squared[:, 1:2, 1])[:, 0], rel=1e-13)
