"""The numbers that are known of elastic films under voltage, each from an equation of its own."""

from __future__ import annotations

import numpy as np
import pytest
from peers import closed_forms as forms

pytestmark = pytest.mark.trust


def to_the_last_digit(stated: str) -> object:
    """A number as printed: half a unit of its last digit."""
    return pytest.approx(float(stated), abs=0.5 * 10.0 ** -len(stated.partition(".")[2]) * (1 + 1e-9))


@pytest.mark.parametrize(
    ("prestretch", "stated"),
    [
        (1.0, [("1.2634", "0.68918"), ("5.3149", "0.26252")]),
        (1.7, [("2.6653", "0.26065")]),
        (1.9, [("3.1351", "0.23871")]),
    ],
)
def test_pull_in_of_a_gent_film_under_dead_load(prestretch: float, stated: list[tuple[str, str]]) -> None:
    for turn, numbers in zip(forms.turns(prestretch, 110.0), stated, strict=False):
        assert turn == tuple(to_the_last_digit(number) for number in numbers)


def test_a_gent_film_lands_where_it_stiffens() -> None:
    assert forms.landing(1.0, 110.0) == to_the_last_digit("7.3736")


def test_large_prestretch_does_away_with_pull_in() -> None:
    largest = forms.last_pull_in(110.0)
    assert largest == to_the_last_digit("2.0965")
    assert len(forms.turns(largest - 1e-3, 110.0)) == 2
    assert not forms.turns(largest + 1e-3, 110.0)


def test_a_neo_hookean_film_without_load() -> None:
    stretch, field = forms.neo_hookean_pull_in()
    assert stretch == to_the_last_digit("1.25992")
    assert stretch == pytest.approx(2 ** (1 / 3), rel=1e-15)
    assert field == to_the_last_digit("0.687365")
    assert forms.slope(lambda x: forms.dead_load_field(x, 1.0), stretch) == pytest.approx(0.0, abs=1e-15)
    assert np.sqrt(forms.dead_load_field(stretch, 1.0)) == pytest.approx(field, rel=1e-15)
    assert forms.turns(1.0, 1e5)[0] == pytest.approx((stretch, field), rel=1e-4)


def test_a_permittivity_that_falls_with_the_stretch() -> None:
    assert forms.softening_dielectric_pull_in(-0.053) == (to_the_last_digit("1.27506"), to_the_last_digit("0.70969"))
    assert forms.softening_dielectric_pull_in(0.0) == pytest.approx(forms.neo_hookean_pull_in(), rel=1e-12)


def test_a_charged_film_and_its_leak() -> None:
    assert forms.charged_stretch(3.0) == to_the_last_digit("1.25992")
    left = forms.leaking_charge(np.sqrt(3.0), 1.0)
    assert forms.charged_stretch(left**2) == to_the_last_digit("1.05844")


def test_dead_load_beside_a_frame() -> None:
    dead = np.sqrt(forms.dead_load_field(3.3, 3.0, 110.0))
    assert dead == to_the_last_digit("0.118813")
    assert 0.163110 / dead == to_the_last_digit("1.37")


def test_small_strains() -> None:
    field = 1e-4
    stretch = 1 + forms.dead_load_small_strain(field)
    assert forms.dead_load_field(stretch, 1.0) == pytest.approx(field**2, rel=1e-6)
    # a disc far from its frame moves three quarters as far as under dead load
    assert forms.framed_small_strain(field, 0.0) == pytest.approx(0.75 * forms.dead_load_small_strain(field), rel=1e-15)


@pytest.mark.parametrize("width", [1.0, 1.5, 3.0])
def test_pure_shear_diverges_and_has_no_maximum(width: float) -> None:
    for share in (0.2, 0.9, 0.999):
        field = share / width
        x = forms.pure_shear_stretch(field, width)
        assert x**2 - (x * width) ** -2 == pytest.approx(field**2 * (x * width) ** 2, rel=1e-10)
    assert forms.pure_shear_stretch(np.sqrt(1 - 1e-12) / width, width) > 500 / np.sqrt(width)


def test_the_life_of_a_silicone_film() -> None:
    assert forms.damage_exponent(62.0, 100 / 80) == to_the_last_digit("18.5")


def test_other_closed_forms_hold_their_own_equations() -> None:
    x = forms.held_uniaxially(2.0, 110.0)
    assert (x - x**-2) / (1 - (x**2 + 2 / x - 3) / 110.0) == pytest.approx(2.0, rel=1e-12)
    assert forms.breakdown_stretch(40e6, 8e6) == pytest.approx(np.sqrt(5.0))
