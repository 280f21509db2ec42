"""Cards for finite-element codes: what is refused, what is allowed and named, and how the text is written."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dielast import CardOptions, Gent, InputError, Material, NeoHookean, Spectrum, Yeoh, export_card
from dielast.base.errors import DielastWarning
from dielast.handover.export.card import CODES, export_cards, identifier
from dielast.handover.export.code import number
from dielast.material.shift import WLF, Arrhenius, NoShift, ShiftTable

WLF_LAW = WLF(20.0, 13.7, 187.1)
SPECTRUM = Spectrum(np.array([1e3, 10.0, 0.1]), np.array([1e4, 3e4, 7e5]))
NEO = Material("Film (1)", 26e3, SPECTRUM, WLF_LAW)
GENT = replace(NEO, equilibrium_law=Gent(110.0), nonequilibrium_law=Gent(55.0))
AT_20 = CardOptions(temperature=20.0)


def only(files: dict[str, str]) -> str:
    (text,) = files.values()
    return text


def test_every_code_carries_a_neo_hookean_material_at_one_temperature() -> None:
    files = export_cards(NEO, CODES.names, AT_20)
    assert set(files) == {
        "material.inp",
        "material.mac",
        "material.feb",
        "material-comsol-parameters.txt",
        "material-comsol-branches-energy-factor.txt",
        "material-comsol-branches-shear-modulus.txt",
        "material-comsol-notes.txt",
        "material.mfront",
    }
    assert files == export_cards(NEO, CODES.names, AT_20)
    for name, text in files.items():
        assert text.isascii(), name
        assert text.endswith("\n"), name
        assert "APPROXIMATION" not in text, name


def test_an_unknown_code_and_wrong_options_are_refused() -> None:
    with pytest.raises(InputError, match=r'^formats: "nastran": one of abaqus, ansys, febio, comsol, mfront is needed$'):
        export_card(NEO, "nastran")
    wrong: tuple[tuple[dict[str, Any], str], ...] = (
        ({"units": "cgs"}, 'units: "cgs": one of SI, mm-t-s, mm-N-MPa is needed'),
        (
            {"hyperelastic": "varga"},
            'hyperelastic: "varga": one of arruda-boyce, gent, mooney-rivlin, neo-hookean, ogden, yeoh is needed',
        ),
        ({"moduli": "both"}, 'moduli: "both"'),
        ({"temperature_scale": "F"}, 'temperature_scale: "F"'),
        ({"J_lim": -1.0}, "J_lim: -1: a positive number is needed"),
        ({"bulk_modulus": math.nan}, "bulk_modulus: nan"),
        ({"poisson_ratio": 0.5}, "poisson_ratio: 0.5: at least 0 and below 0.5 is needed"),
        ({"poisson_ratio": 0.4, "bulk_modulus": 1.0}, "bulk_modulus: state bulk_modulus or poisson_ratio, not both"),
    )
    for options, line in wrong:
        with pytest.raises(InputError, match=re.escape(line)):
            export_card(NEO, "ansys", CardOptions(**options))


def test_springs_that_a_code_has_not_are_named_not_replaced() -> None:
    with pytest.raises(InputError, match=r'^hyperelastic: abaqus has no "gent" law: allow "neo-hookean" or "yeoh" instead'):
        export_card(GENT, "abaqus")
    for form in ("ansys", "comsol"):
        with pytest.raises(InputError, match=rf"^J_lim: {form} has one J_lim .* not 110 and 55"):
            export_card(GENT, form)
    with pytest.raises(
        InputError, match=r'^hyperelastic: the "arruda-boyce" law of febio is a series with other .*: allow "gent" or "neo-hookean"'
    ):
        export_card(GENT, "febio", CardOptions(hyperelastic="arruda-boyce"))
    with pytest.raises(InputError, match=r'^hyperelastic: "gent" needs a J_lim'):
        export_card(NEO, "ansys", CardOptions(hyperelastic="gent"))
    with pytest.raises(InputError, match="a card holds Gent springs of one J_lim only"):
        export_card(replace(NEO, equilibrium_law=Gent(np.array([10.0, 20.0]))), "ansys")


def test_an_allowed_approximation_is_stated_in_the_card() -> None:
    for law, said in (("neo-hookean", "(I1 - 3)/J_lim of Gent's stiffness"), ("yeoh", "((I1 - 3)/J_lim)^3")):
        text = only(export_card(GENT, "abaqus", CardOptions(hyperelastic=law, J_lim=None if law == "neo-hookean" else 55.0)))
        assert (
            "** APPROXIMATION, allowed by the recipe: the material's springs are Gent's with J_lim = 110 (equilibrium) and 55"
            in text
        )
        assert said in text
    assert "APPROXIMATION" not in only(export_card(GENT, "mfront"))
    same = replace(GENT, nonequilibrium_law=Gent(110.0))
    assert "APPROXIMATION" not in only(export_card(same, "ansys"))
    assert "APPROXIMATION" in only(export_card(same, "ansys", CardOptions(J_lim=80.0)))


def test_the_loss_of_each_spring_is_stated_where_laws_differ() -> None:
    gent, yeoh = "(I1 - 3)/J_lim of Gent's stiffness", "of Yeoh's stiffness"
    soft = CardOptions(hyperelastic="neo-hookean")
    for first, rest, said in (
        (NeoHookean(), Gent(55.0), ["Branches:", gent]),
        (Gent(), Gent(55.0), ["Branches:", gent]),
        (Gent(110.0), NeoHookean(), ["Equilibrium spring:", gent]),
        (Yeoh(1e4, 100.0), Gent(55.0), ["Equilibrium spring:", yeoh, "Branches:", gent]),
        (Gent(110.0), Gent(55.0), [gent]),
    ):
        text = only(export_card(replace(NEO, equilibrium_law=first, nonequilibrium_law=rest), "abaqus", soft))
        assert re.findall("|".join(map(re.escape, ("Equilibrium spring:", "Branches:", gent, yeoh))), text) == said
    mixed = replace(NEO, equilibrium_law=NeoHookean(), nonequilibrium_law=Gent(55.0))
    assert "Springs: gent, neo-Hookean in equilibrium and Gent (J_lim = 55) in the branches. " in only(export_card(mixed, "mfront"))


def test_a_shift_law_that_a_code_has_not_needs_one_temperature() -> None:
    table = replace(NEO, shift=ShiftTable(20.0, (0.0, 20.0, 40.0), (1.5, 0.0, -1.0)))
    for form in ("abaqus", "ansys", "febio"):
        with pytest.raises(InputError, match=f'^temperature: {form} has no shift function for the law "table"'):
            export_card(table, form)
        assert "hold at 30 degC ONLY" in only(export_card(table, form, CardOptions(temperature=30.0)))
        with pytest.raises(InputError, match=r"^temperature: 50 degC is outside"):
            export_card(table, form, CardOptions(temperature=50.0))
        assert "ONLY" not in only(export_card(replace(NEO, shift=NoShift(20.0)), form))
    with pytest.raises(InputError, match=r"^temperature: febio has no shift function"):
        export_card(NEO, "febio")
    with pytest.raises(InputError, match=r'^temperature_scale: ansys takes the Arrhenius law in absolute temperatures only: "K"'):
        export_card(replace(NEO, shift=Arrhenius(20.0, 1e5)), "ansys")


def test_more_branches_than_a_code_takes_are_refused_with_the_number() -> None:
    def with_branches(count: int) -> Material:
        return replace(NEO, spectrum=Spectrum(np.logspace(3, -3, count), np.full(count, 1e4)), shift=NoShift(20.0))

    for form, most in (("febio", 6), ("ansys", 100)):
        export_card(with_branches(most), form)
        with pytest.raises(InputError, match=rf"^formats: {form} takes at most {most} Prony terms, the spectrum has {most + 1}"):
            export_card(with_branches(most + 1), form)
    export_card(with_branches(500), "abaqus")


def test_a_material_that_flows() -> None:
    flowing = replace(NEO, equilibrium_modulus=0.0)
    for form in ("abaqus", "ansys", "comsol"):
        with pytest.raises(InputError, match=f"^formats: {form} needs an equilibrium modulus above zero") as caught:
            export_card(flowing, form)
        assert "state fit.equilibrium_modulus" in str(caught.value)
    for moduli in ("instantaneous", "long-term"):
        text = only(export_card(flowing, "febio", replace(AT_20, moduli=moduli)))
        assert "<g0>0</g0>" in text
        assert "time zero" in text
    assert "mu_eq = 0;" in only(export_card(flowing, "mfront"))


def test_an_equilibrium_modulus_that_rounding_would_lose_is_refused() -> None:
    stiff = replace(NEO, equilibrium_modulus=1e-4)
    for form in ("abaqus", "ansys"):
        with pytest.raises(InputError, match=rf"^formats: {form} takes one minus the sum"):
            export_card(stiff, form)
    export_card(stiff, "mfront")


def test_branches_without_a_modulus_are_left_out_and_named() -> None:
    sparse = replace(NEO, spectrum=Spectrum(np.array([1e3, 10.0, 0.1, 0.01]), np.array([1e4, 0.0, 3e4, 0.0])))
    with pytest.warns(DielastWarning, match="leave out 2 branches of zero modulus"):
        text = only(export_card(sparse, "ansys"))
    assert "! Left out: branches of zero modulus (2)." in text
    assert "TB,PRONY,DIELAST_MAT,1,2,SHEAR" in text
    with pytest.raises(InputError, match=r"no branch has a modulus: .*; state the spring, .* shear modulus of .* Pa, as a hyper"):
        export_card(replace(NEO, spectrum=Spectrum(np.array([1.0]), np.array([0.0]))), "ansys")


def test_numbers_keep_15_digits_within_20_characters() -> None:
    assert number(1 / 3) == "0.333333333333333"
    assert float(number(0.1)) == 0.1
    for value in (1 / 3 * 1e-5, -1 / 3 * 1e-5, 1 / 3 * 1e-300, -1 / 3 * 1e300, 0.0, 26e3):
        assert len(number(value)) <= 20
        assert float(number(value)) == pytest.approx(value, rel=1e-12)


def test_lines_are_short_enough_for_every_reader() -> None:
    material = replace(NEO, spectrum=Spectrum(np.logspace(5, -7, 30), np.logspace(3, 7, 30) / 3))
    for form, longest in (("abaqus", 256), ("ansys", 640)):
        lines = only(export_card(material, form)).splitlines()
        assert max(map(len, lines)) <= longest
        if form == "abaqus":
            data = [line for line in lines if not line.startswith("*")]
            assert all(len(line.split(",")) <= 8 for line in data)
            assert all(len(entry.strip()) <= 20 for line in data for entry in line.split(","))
        else:
            assert all(len(line.split(",")) <= 8 for line in lines if line.startswith("TBDATA"))


@settings(max_examples=10)
@given(name=st.text(max_size=80))
def test_no_name_breaks_a_card(name: str) -> None:
    odd = replace(NEO, name=name)
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", identifier(name))
    plain_cards = export_cards(NEO, CODES.names, AT_20)
    for file, text in export_cards(odd, CODES.names, AT_20).items():
        assert text.isascii(), file
        assert text.count("\n") == plain_cards[file].count("\n"), file
    ElementTree.fromstring(only(export_card(odd, "febio", AT_20)))


def test_one_code_says_all_that_it_cannot_carry_at_once() -> None:
    many = Spectrum(np.logspace(3, -3, 7), np.full(7, 1e4))
    table = ShiftTable(20.0, (0.0, 20.0, 40.0), (1.5, 0.0, -1.0))
    with pytest.raises(InputError) as caught:
        export_card(replace(GENT, spectrum=many, shift=table), "febio", CardOptions(hyperelastic="arruda-boyce", bulk_modulus=1.0))
    keys = [line.split(":")[0] for line in caught.value.messages]
    assert keys == ["formats", "hyperelastic", "temperature", "bulk_modulus"]
    flowing = replace(GENT, equilibrium_modulus=0.0, spectrum=Spectrum(np.logspace(3, -3, 101), np.full(101, 1e4)))
    with pytest.raises(InputError) as caught:
        export_card(replace(flowing, shift=Arrhenius(20.0, 1e5)), "ansys")
    keys = [line.split(":")[0] for line in caught.value.messages]
    assert keys == ["formats", "formats", "J_lim", "temperature_scale"]


@pytest.mark.parametrize("form", CODES.names)
def test_a_bulk_modulus_that_makes_poissons_ratio_negative_is_refused(form: str) -> None:
    least = 2 / 3 * (26e3 + 74e4)
    for bulk in (1.0, 0.999999 * least):
        with pytest.raises(InputError, match=r"^bulk_modulus: .* makes Poisson's ratio negative: more than 5.107e\+05 Pa"):
            export_cards(NEO, (form,), replace(AT_20, bulk_modulus=bulk))
    export_card(NEO, form, replace(AT_20, bulk_modulus=1.001 * least))
