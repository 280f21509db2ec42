"""Cards of springs beyond Gent's: each code's own energy of the written constants is that of the material's spring."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from dielast import CardOptions, Gent, InputError, Material, NoShift, Spectrum, export_card
from dielast.handover.export.card import CODES
from dielast.material.springs import ArrudaBoyce, GentI2, MooneyRivlin, NeoHookean, Ogden, SpringLaw, Yeoh

SPECTRUM = Spectrum(np.array([10.0, 0.1]), np.array([3e4, 7e5]))
REST, INSTANTANEOUS = 26e3, 26e3 + 73e4
LAWS = {
    law.name: law
    for law in (
        GentI2(90.0, 0.4, 0.9),
        Yeoh(1.0, -0.01, 2e-4),
        ArrudaBoyce(5.0),
        MooneyRivlin(9.0, 1.0),
        Ogden((18.0, -2.0, 0.1), (1.6, -2.5, 4.0)),
    )
}
LONGEST = Ogden((18.0, -2.0, 0.1, 0.01, 0.02), (1.6, -2.5, 4.0, 3.0, 1.0))
STRETCHES = np.exp(np.random.default_rng(2).uniform(-0.3, 0.6, (2, 50)))
SERIES = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


def material(law: SpringLaw) -> Material:
    return Material("film", REST, SPECTRUM, NoShift(20.0), law, law)


def invariants() -> tuple[Any, Any]:
    a, b = STRETCHES**2
    return a + b + 1 / (a * b) - 3, 1 / a + 1 / b + a * b - 3


def yeoh(c10: float, c20: float, c30: float, *rest: float) -> Any:
    x, _ = invariants()
    return c10 * x + c20 * x**2 + c30 * x**3


def mooney_rivlin(c10: float, c01: float, *rest: float) -> Any:
    first, second = invariants()
    return c10 * first + c01 * second


def series(mu: float, locking: float, *rest: float) -> Any:
    first = invariants()[0] + 3
    return mu * sum(c / locking ** (2 * k - 2) * (first**k - 3**k) for k, c in enumerate(SERIES, 1))


def powers(factors: list[float], exponents: list[float]) -> Any:
    l1, l2 = STRETCHES
    return sum(f * (l1**a + l2**a + (l1 * l2) ** -a - 3) for f, a in zip(factors, exponents, strict=True))


def numbers(text: str) -> list[float]:
    return [float(entry) for entry in text.replace("\n", ",").split(",") if entry.strip()]


def abaqus(law: str, files: dict[str, str]) -> Any:
    data = re.search(r"\*HYPERELASTIC, ([^\n]*)\n((?:[^*\n]*\n)*)", files["material.inp"])
    assert data
    assert all(len(line.split(",")) <= 8 for line in data[2].splitlines())
    values = numbers(data[2])
    if law == "ogden":
        given = re.match(r"OGDEN, N=(\d)", data[1])
        assert given
        terms = int(given[1])
        assert len(values) == 3 * terms
        mu, alpha = values[: 2 * terms : 2], values[1 : 2 * terms : 2]
        assert sum(mu) == pytest.approx(INSTANTANEOUS, rel=1e-12)
        return powers([2 * m / a**2 for m, a in zip(mu, alpha, strict=True)], alpha)
    assert data[1].startswith({"yeoh": "YEOH,", "arruda-boyce": "ARRUDA-BOYCE,", "mooney-rivlin": "MOONEY-RIVLIN,"}[law])
    return {"yeoh": yeoh, "arruda-boyce": series, "mooney-rivlin": mooney_rivlin}[law](*values)


def ansys(law: str, files: dict[str, str]) -> Any:
    text = files["material.mac"]
    data = re.search(r"TB,HYPER,DIELAST_MAT,1,(\d),(\w+)\n((?:TBDATA[^\n]*\n)*)", text)
    assert data
    rows = [numbers(row.removeprefix("TBDATA,")) for row in data[3].splitlines()]
    assert [int(row[0]) for row in rows] == [1 + 6 * index for index in range(len(rows))]
    assert all(len(row) <= 7 for row in rows)
    values = [value for row in rows for value in row[1:]]
    if law == "ogden":
        terms = int(data[1])
        assert (data[2], len(values)) == ("OGDEN", 3 * terms)
        mu, alpha = values[: 2 * terms : 2], values[1 : 2 * terms : 2]
        return powers([m / a for m, a in zip(mu, alpha, strict=True)], alpha)
    assert data[2] == {"yeoh": "YEOH", "arruda-boyce": "BOYCE", "mooney-rivlin": "MOONEY"}[law]
    return {"yeoh": yeoh, "arruda-boyce": series, "mooney-rivlin": mooney_rivlin}[law](*values)


def febio(law: str, files: dict[str, str]) -> Any:
    elastic = ElementTree.fromstring(files["material.feb"]).find("Material/material/elastic")
    assert elastic is not None
    value = {entry.tag: float(entry.text) for entry in elastic if entry.text}
    if law == "ogden":
        assert elastic.get("type") == "Ogden"
        terms = range(1, len(value) // 2 + 1)
        return powers([value[f"c{k}"] / value[f"m{k}"] ** 2 for k in terms], [value[f"m{k}"] for k in terms])
    if law == "yeoh":
        assert elastic.get("type") == "Yeoh"
        return yeoh(value["c1"], value["c2"], value["c3"])
    assert elastic.get("type") == "Mooney-Rivlin"
    return mooney_rivlin(value["c1"], value["c2"])


def comsol(law: str, files: dict[str, str]) -> Any:
    rows = re.findall(r"(\w+) ([-+.\deE]+)(?:\[.+\])? ", files["material-comsol-parameters.txt"])
    value = {name: float(text) for name, text in rows}
    scale = INSTANTANEOUS / REST  # the parent is the long-term spring
    if law == "ogden":
        terms = range(1, sum(name.startswith("alpha_") for name in value) + 1)
        return scale * powers([value[f"mu_{k}"] / value[f"alpha_{k}"] for k in terms], [value[f"alpha_{k}"] for k in terms])
    match law:
        case "yeoh":
            return scale * yeoh(value["c1"], value["c2"], value["c3"])
        case "mooney-rivlin":
            return scale * mooney_rivlin(value["C10"], value["C01"])
    return scale * series(value["mu0"], value["N_segments"] ** 0.5)


READERS: dict[str, Callable[[str, dict[str, str]], Any]] = {"abaqus": abaqus, "ansys": ansys, "febio": febio, "comsol": comsol}


@pytest.mark.parametrize("form", READERS)
@pytest.mark.parametrize("law", [*LAWS.values(), LONGEST], ids=[*LAWS, "ogden-5"])
def test_the_energy_of_a_card_is_that_of_the_spring(form: str, law: SpringLaw) -> None:
    film = material(law)
    if law.name not in CODES[form].springs:
        lacks = f'{form} has no "{law.name}" law'
        if law.name in CODES[form].unlike:
            lacks = f'the "{law.name}" law of {form} is a series with other coefficients .*'
        with pytest.raises(
            InputError, match=rf'^hyperelastic: {lacks}: allow ("gent" or )?"neo-hookean"( or "mooney-rivlin")? instead'
        ):
            export_card(film, form)
        text = "".join(export_card(film, form, CardOptions(hyperelastic="neo-hookean")).values())
        assert f"APPROXIMATION, allowed by the recipe: the material's springs are {law.title}'s" in text
        if law.name == "gent-i2":
            text = "".join(export_card(film, form, CardOptions(hyperelastic="mooney-rivlin")).values())
            assert "Mooney-Rivlin's second term is linear in I2" in text
        return
    files = export_card(film, form)
    assert "APPROXIMATION" not in "".join(files.values())
    expected = INSTANTANEOUS * law.energy(STRETCHES**2)
    # the codes have five terms of the series of Arruda and Boyce, which these stretches do not tell from the whole
    within = 2e-4 if law.name == "arruda-boyce" else 1e-11
    assert READERS[form](law.name, files) == pytest.approx(expected, rel=within, abs=1e-6)


def test_springs_that_are_the_same_are_written_as_what_a_code_has() -> None:
    assert "NEO HOOKE" in export_card(material(Ogden((2.0,), (2.0,))), "abaqus")["material.inp"]
    assert "NEO HOOKE" in export_card(material(MooneyRivlin(2.0)), "abaqus")["material.inp"]
    assert "NEO HOOKE" in export_card(material(ArrudaBoyce()), "abaqus")["material.inp"]
    assert "MOONEY-RIVLIN" in export_card(material(GentI2(I2_share=0.3, I2_exponent=1.0)), "abaqus")["material.inp"]
    assert "Gent" in export_card(material(GentI2(90.0)), "ansys")["material.mac"]
    pair = replace(material(MooneyRivlin(9.0, 1.0)), nonequilibrium_law=Ogden((18.0, -2.0), (2.0, -2.0)))
    card = export_card(pair, "febio")["material.feb"]
    assert "Mooney-Rivlin" in card
    assert "APPROXIMATION" not in card
    scaled = replace(material(Yeoh(1.0, -0.01, 2e-4)), nonequilibrium_law=Yeoh(3.0, -0.03, 6e-4))
    assert "YEOH" in export_card(scaled, "abaqus")["material.inp"]


def test_laws_that_differ_between_equilibrium_spring_and_branches_are_refused() -> None:
    two = replace(material(Yeoh(1.0, -0.01)), nonequilibrium_law=Yeoh(1.0, -0.02))
    with pytest.raises(
        InputError, match=r"^hyperelastic: abaqus has one set of constants .* Yeoh \(C10/modulus = 0.5, C20/modulus = -0.005"
    ):
        export_card(two, "abaqus")
    mixed = replace(material(NeoHookean()), nonequilibrium_law=ArrudaBoyce(5.0))
    alike = r"abaqus has one law for the equilibrium spring and the branches alike, not neo-Hookean and Arruda-Boyce \(.* = 5\)"
    with pytest.raises(InputError, match=f'^hyperelastic: {alike}: allow "neo-hookean" instead'):
        export_card(mixed, "abaqus")
    assert "NEO HOOKE" in export_card(mixed, "abaqus", CardOptions(hyperelastic="neo-hookean"))["material.inp"]
    with pytest.raises(InputError, match="the material's Yeoh springs have no J_lim"):
        export_card(two, "abaqus", CardOptions(J_lim=100.0))
    with pytest.raises(InputError, match="abaqus takes at most 6 terms of an Ogden spring, not 7"):
        export_card(material(Ogden((1.0,) * 7, (1.0, 1.5, 2.5, 3.0, 3.5, 4.0, 4.5))), "abaqus")
    with pytest.raises(InputError, match='"ogden" cannot stand for Gent'):
        export_card(
            replace(two, equilibrium_law=Gent(50.0), nonequilibrium_law=Gent(50.0)), "abaqus", CardOptions(hyperelastic="ogden")
        )
