"""Prony series in the cards of finite-element codes are read back to the same moduli; units are stated, never guessed."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dielast import WLF, Arrhenius, CardOptions, Gent, InputError, Material, NoShift, Spectrum, Yeoh, export_card
from dielast.commands.spectrum.recipe import SpectrumRecipe
from dielast.commands.spectrum.run import run
from dielast.commands.spectrum.sources import card_of
from dielast.handover.material_file import parse_material
from dielast.handover.prony_card import read_prony
from dielast.io.files import Inputs
from dielast.material.springs import MooneyRivlin, Ogden
from dielast.recipe.cases import Case
from dielast.sharing.execution import Execution

SHARED = Path(__file__).parents[3] / "shared/data/ansys_prony/prony_terms.MPL"
SOLID = Material("solid", 2e4, Spectrum(np.array([100.0, 1.0, 1e-3]), np.array([1e3, 5e4, 2e6])), NoShift(20.0))
SPRINGS = [Gent(), Yeoh(1e4, -50.0, 2.0), MooneyRivlin(7e3, 3e3), Ogden((1.8e4, -2e3), (1.6, -2.5))]


@pytest.mark.parametrize("law", SPRINGS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize(
    ("form", "options"),
    [
        ("abaqus", {"moduli": "long-term", "units": "mm-t-s"}),
        ("abaqus", {"moduli": "instantaneous"}),
        ("ansys", {"units": "mm-N-MPa"}),
    ],
)
def test_a_card_of_dielast_is_read_back(form: str, options: dict[str, str], law: Gent) -> None:
    modulus = law.initial_modulus() or 2e4
    material = replace(SOLID, equilibrium_modulus=modulus, equilibrium_law=law, nonequilibrium_law=law)
    hyperelastic = {"hyperelastic": "neo-hookean"} if isinstance(law, Gent) else {}
    (text,) = export_card(material, form, CardOptions(**options, **hyperelastic)).values()
    back = read_prony(text.encode(), "job", options.get("units", "SI")).material()
    assert back.equilibrium_modulus == pytest.approx(modulus, rel=1e-6)
    np.testing.assert_allclose(back.spectrum.relaxation_time, SOLID.spectrum.relaxation_time, rtol=1e-9)
    np.testing.assert_allclose(back.spectrum.shear_modulus, SOLID.spectrum.shear_modulus, rtol=1e-9)
    stretch = np.square(np.array([[1.7], [0.8]]))
    for one, other in ((law, back.equilibrium_law), (law, back.nonequilibrium_law)):
        shapes = [spring.of_modulus(1.0).stress(stretch) for spring in (one, other)]
        np.testing.assert_allclose(*(np.asarray(shape) / np.asarray(shape)[0] for shape in shapes), rtol=1e-6)


@pytest.mark.skipif(not SHARED.exists(), reason="measured data are not here")
def test_a_measured_series_of_ansys_takes_its_modulus_from_the_recipe() -> None:
    card = read_prony(SHARED.read_bytes(), "prony_terms.MPL", "mm-t-s")
    assert len(card.g) == 31
    assert (card.g[0], card.tau[0], card.tau[-1]) == (5.456514e-02, 0.01, 1e28)
    material = card.material(instantaneous=1739.03e6 / 3)
    np.testing.assert_allclose(material.spectrum.shear_modulus, np.array(card.g) * 1739.03e6 / 3, rtol=1e-12)
    with pytest.raises(InputError, match=r"one modulus is needed: state fit\.glassy_modulus"):
        card.material()


ABAQUS = """*MATERIAL, NAME=Foil
*ELASTIC, MODULI={moduli}
 3.0, 0.5
*VISCOELASTIC,
 TIME=PRONY
 0.5, , 1.0
 0.25, 0., 100.
"""


@pytest.mark.parametrize(("moduli", "whole"), [("INSTANTANEOUS", 1e6), ("LONG TERM", 4e6)])
def test_elastic_moduli_are_long_term_or_instantaneous(moduli: str, whole: float, tmp_path: Path) -> None:
    (tmp_path / "job.inp").write_text(ABAQUS.format(moduli=moduli))
    stated = {"kind": "spectrum", "prony": "job.inp", "prony_units": "mm-t-s", "material": {"relative_permittivity": 4.0}}
    recipe = SpectrumRecipe.model_validate(stated, context={"folder": tmp_path})
    report = run([Case(recipe, {}, {})], Inputs(tmp_path), Execution())  # type: ignore[arg-type]
    material = parse_material(report.files["material.toml"], "material.toml")
    assert (material.name, material.spectrum.relaxation_time.tolist()) == ("Foil", [1.0, 100.0])
    np.testing.assert_allclose(material.spectrum.shear_modulus, [0.5 * whole, 0.25 * whole], rtol=1e-9)
    assert material.equilibrium_modulus == pytest.approx(0.25 * whole)
    assert set(material.origin.values()) == {"stated"}
    assert card_of(recipe, Inputs(tmp_path))[0].name == "Foil"


def test_units_and_moduli_are_never_guessed() -> None:
    text = ABAQUS.format(moduli="LONG TERM").encode()
    with pytest.raises(InputError, match="a card does not state its units: state prony_units"):
        read_prony(text, "job.inp", None)
    with pytest.raises(InputError, match=r"TIME=PRONY"):
        read_prony(text.replace(b"PRONY", b"CREEP"), "job.inp", "SI")
    with pytest.raises(InputError, match=r"leave fit\.glassy_modulus"):
        read_prony(text, "job.inp", "SI").material(instantaneous=1e6)
    table = read_prony(b"g_i,tau_i [s]\n0.5,1\n0.25,100\n", "p.csv", None)
    assert table.material(equilibrium=1e6).spectrum.shear_modulus.tolist() == [2e6, 1e6]
    with pytest.raises(InputError, match=r"tau"):
        read_prony(b"g_i,tau_i\n0.5,1\n0.25,100\n", "p.csv", None)
    with pytest.raises(InputError, match=r"the sum is 1\.5"):
        read_prony(b"g_i,tau_i [s]\n0.75,1\n0.75,100\n", "p.csv", None).material(instantaneous=1e6)
    shifted = export_card(replace(SOLID, shift=WLF(20.0, 13.0, 180.0)), "abaqus", CardOptions())["material.inp"]
    with pytest.raises(InputError, match=r"say whether 20 is in degC or K: state prony_temperature_scale"):
        read_prony(shifted.encode(), "material.inp", "SI")
    with pytest.warns(Warning, match=re.escape("*TRS of the card: not read")):
        read_prony(shifted.replace("WLF", "USER").encode(), "material.inp", "SI")


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("*TRS\n abc, 13.7, 187.\n", "constants of the shift law: numbers are needed"),
        ("*TRS\n 20., 13.7, -187.\n", "C2: -187"),
        ("*PHYSICAL CONSTANTS, UNIVERSAL GAS CONSTANT=0\n*TRS, DEFINITION=ARRHENIUS\n 293., 1e7\n", "GAS CONSTANT above 0"),
    ],
)
def test_constants_of_a_shift_law_that_cannot_be_are_refused(lines: str, message: str) -> None:
    with pytest.raises(InputError, match=f"job.inp: .*{message}"):
        read_prony((ABAQUS.format(moduli="LONG TERM") + lines).encode(), "job.inp", "SI", "K")


@pytest.mark.parametrize("units", ["SI", "mm-t-s"])
@pytest.mark.parametrize("scale", ["degC", "K"])
@pytest.mark.parametrize("shift", [WLF(20.0, 13.0, 180.0), Arrhenius(20.0, 6.3e4)], ids=["wlf", "arrhenius"])
@pytest.mark.parametrize("form", ["abaqus", "ansys"])
def test_the_shift_law_of_a_card_is_read_back(form: str, shift: WLF, scale: str, units: str) -> None:
    if form == "ansys" and isinstance(shift, Arrhenius):
        scale = "K"  # ANSYS takes this law in kelvin only
    options = CardOptions(units=units, temperature_scale=scale)
    (text,) = export_card(replace(SOLID, shift=shift), form, options).values()
    back = read_prony(text.encode(), "card", units, scale).material().shift
    assert type(back) is type(shift)
    temperature = np.array([-10.0, 20.0, 60.0])
    np.testing.assert_allclose(back.log10_shift_factor(temperature), shift.log10_shift_factor(temperature), rtol=1e-6, atol=1e-9)
