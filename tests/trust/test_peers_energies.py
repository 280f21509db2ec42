"""The peers' energies: derivatives against each other, limits, and Gent's stress and tangent written out."""

from __future__ import annotations

import numpy as np
import pytest
from peers.energies import (
    Energy,
    arruda_boyce,
    chain,
    gent,
    gent_i2,
    inverse_langevin,
    langevin,
    mooney_rivlin,
    neo_hookean,
    ogden,
    stress,
    tangent,
    yeoh,
)
from peers.taylor import stretches

pytestmark = pytest.mark.trust

MU = 26e3
LAWS: dict[str, Energy] = {
    "neo-hookean": lambda l1, l2: neo_hookean(l1, l2, MU),
    "gent": lambda l1, l2: gent(l1, l2, MU, 55.0),
    "gent-i2": lambda l1, l2: gent_i2(l1, l2, 0.6 * MU, 90.0, 0.4 * MU, 0.9),
    "gent-gent": lambda l1, l2: gent_i2(l1, l2, 0.6 * MU, 90.0, 0.4 * MU, 0),
    "yeoh": lambda l1, l2: yeoh(l1, l2, MU / 2, -150.0, 12.0),
    "arruda-boyce": lambda l1, l2: arruda_boyce(l1, l2, MU, 3.5),
    "mooney-rivlin": lambda l1, l2: mooney_rivlin(l1, l2, 0.35 * MU, 0.15 * MU),
    "ogden": lambda l1, l2: ogden(l1, l2, (0.9 * MU, -0.2 * MU), (1.6, -2.8)),
}
L1, L2 = np.array([1.0, 1.3, 2.5, 0.7, 4.0]), np.array([1.0, 0.9, 2.5, 1.4, 0.8])


@pytest.fixture(params=LAWS)
def law(request: pytest.FixtureRequest) -> Energy:
    return LAWS[request.param]


def test_complex_steps_and_taylor_numbers_agree(law: Energy) -> None:
    value, p1, p2, *_ = law(*stretches(np.log(np.stack((L1, L2))))).parts
    assert value == pytest.approx(law(L1, L2), rel=1e-13, abs=1e-9 * MU)
    assert np.stack((p1 / L1, p2 / L2)) == pytest.approx(stress(law, L1, L2), rel=1e-12, abs=1e-12 * MU)


def test_the_tangent_is_the_slope_of_the_stress(law: Energy) -> None:
    def difference(step: float) -> np.ndarray:
        return np.stack(
            (
                (stress(law, L1 + step, L2) - stress(law, L1 - step, L2)) / (2 * step),
                (stress(law, L1, L2 + step) - stress(law, L1, L2 - step)) / (2 * step),
            )
        )

    extrapolated = (4 * difference(5e-4) - difference(1e-3)) / 3
    exact = tangent(law, L1, L2)
    assert exact == pytest.approx(extrapolated, rel=1e-7, abs=1e-7 * MU)
    assert np.array_equal(exact[0, 1], exact[1, 0])


def test_rest(law: Energy) -> None:
    one = np.ones(1)
    assert law(one, one) == pytest.approx(0.0, abs=1e-9 * MU)
    assert stress(law, one, one) == pytest.approx(np.zeros((2, 1)), abs=1e-12 * MU)
    assert tangent(law, one, one)[:, :, 0] == pytest.approx(MU * np.array([[4.0, 2.0], [2.0, 4.0]]), rel=1e-10)


def test_no_axis_is_special(law: Energy) -> None:
    assert law(L2, L1) == pytest.approx(law(L1, L2), rel=1e-13)
    assert law(L1, 1 / (L1 * L2)) == pytest.approx(law(L1, L2), rel=1e-12, abs=1e-10 * MU)


@pytest.mark.parametrize(
    "limit",
    [
        lambda l1, l2: gent(l1, l2, MU, 1e9),
        lambda l1, l2: yeoh(l1, l2, MU / 2, 0.0, 0.0),
        lambda l1, l2: arruda_boyce(l1, l2, MU, 3e4),
        lambda l1, l2: mooney_rivlin(l1, l2, MU / 2, 0.0),
        lambda l1, l2: ogden(l1, l2, (0.7 * MU, 0.3 * MU), (2.0, 2.0)),
    ],
)
def test_every_law_has_a_neo_hookean_limit(limit: Energy) -> None:
    plain = LAWS["neo-hookean"]
    assert stress(limit, L1, L2) == pytest.approx(stress(plain, L1, L2), rel=1e-7, abs=1e-7 * MU)
    assert tangent(limit, L1, L2) == pytest.approx(tangent(plain, L1, L2), rel=1e-6, abs=1e-6 * MU)


def test_gent_as_printed() -> None:
    """Eq. 6 of DOI 10.1115/1.4030850 and its derivative."""
    a, b, limit = L1**2, L2**2, 55.0
    c = 1 / (a * b)
    d = 1 - (a + b + c - 3) / limit
    p, q = (a - c) / d, (b - c) / d
    _, p1, p2, k11, k12, k22 = gent(*stretches(np.log(np.stack((L1, L2)))), 1.0, limit).parts
    assert p1 == pytest.approx(p, rel=1e-13)
    assert p2 == pytest.approx(q, rel=1e-13)
    assert k11 == pytest.approx(2 * (a + c) / d + 2 * p**2 / limit, rel=1e-13)
    assert k12 == pytest.approx(2 * c / d + 2 * p * q / limit, rel=1e-12)
    assert k22 == pytest.approx(2 * (b + c) / d + 2 * q**2 / limit, rel=1e-13)


def test_the_inverse_langevin_function() -> None:
    y = np.concatenate((np.geomspace(1e-8, 0.1, 30), np.linspace(0.1, 0.999, 300), 1 - np.geomspace(1e-3, 1e-8, 20)))
    beta = inverse_langevin(y)
    assert langevin(beta)[0] == pytest.approx(y, rel=3e-16, abs=1e-16)
    plain = (beta > 0.5) & (beta < 300)
    assert 1 / np.tanh(beta[plain]) - 1 / beta[plain] == pytest.approx(y[plain], rel=2e-15)
    assert beta[y < 1e-4] == pytest.approx(3 * y[y < 1e-4] + 9 / 5 * y[y < 1e-4] ** 3, rel=1e-15)
    for part, low, high in ((0, 3.9999999, 4.0000001), (1, 3.9999999, 4.0000001)):  # where the two forms meet
        assert langevin(np.array(low))[part] == pytest.approx(langevin(np.array(high))[part], rel=1e-7)
    step = 1e-3 * beta[:200]
    slope = (langevin(beta[:200] + step)[0] - langevin(beta[:200] - step)[0]) / (2 * step)
    assert langevin(beta[:200])[1] == pytest.approx(slope, rel=1e-6)


def test_the_tension_of_a_chain_is_the_slope_of_its_energy() -> None:
    y, step = np.linspace(0.05, 0.97, 93), 1e-3
    near, far = ((chain(y + h) - chain(y - h)) / (2 * h) for h in (step, 2 * step))
    assert (4 * near - far) / 3 == pytest.approx(inverse_langevin(y), rel=1e-5)
    assert np.imag(chain(y + 1e-30j)) / 1e-30 == pytest.approx(inverse_langevin(y), rel=1e-15)


def test_arruda_boyce_is_its_series_far_from_locking() -> None:
    """Five terms of the series that most programs use, in mu_series (I1^i - 3^i)/l_m^(2 i - 2), are right to (I1/3/l_m^2)^5."""
    locking = 12.0
    coefficients = np.array([1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750])
    power = np.arange(1, 6)
    initial = 2 * np.sum(coefficients * power * 3.0 ** (power - 1) / locking ** (2 * power - 2))
    first = L1**2 + L2**2 + (L1 * L2) ** -2
    series = MU / initial * np.sum(coefficients / locking ** (2 * power - 2) * (first[:, None] ** power - 3.0**power), axis=1)
    assert arruda_boyce(L1, L2, MU, locking) == pytest.approx(series, rel=1e-6, abs=1e-8 * MU)


def test_beyond_the_limits_there_is_no_energy() -> None:
    with np.errstate(invalid="ignore"):
        assert np.isnan(arruda_boyce(np.array([9.0]), np.array([9.0]), MU, 3.5)).all()
        assert np.isnan(gent(np.array([9.0]), np.array([9.0]), MU, 55.0)).all()
