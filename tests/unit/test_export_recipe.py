"""The [export] section of a spectrum recipe, from TOML text to files."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.commands.spectrum.recipe import ExportSection, SpectrumRecipe
from dielast.commands.spectrum.run import run
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.recipe.cases import Case
from dielast.recipe.validate import check
from dielast.sharing.execution import Execution

RECIPE = {
    "kind": "spectrum",
    "mastercurve": "example:mastercurve",
    "fit": {"equilibrium_modulus": "0.078 MPa", "branches": 20},
    "truncate": {"keep": 6},
    "material": {"name": "Film", "J_lim": {"equilibrium": 110.0, "nonequilibrium": 55.0}},
}


def files(**export: Any) -> dict[str, str]:
    recipe = check(SpectrumRecipe, RECIPE | ({"export": export} if export else {}), "r.toml", Path())
    report = run([Case(recipe, {})], Inputs(Path()), Execution())
    return {name: content.decode() for name, content in report.files.items()}


def test_cards_stand_beside_the_material_file_and_agree_with_it() -> None:
    written = files(formats=["febio"], hyperelastic="neo-hookean", temperature="20 degC", density="0.96 g/cm^3", units="mm-t-s")
    assert set(written) == {"material.toml", "material.feb"}
    material = parse_material(written["material.toml"].encode(), "material.toml")
    card = ElementTree.fromstring(written["material.feb"]).find("Material/material")
    assert card is not None
    value = {entry.tag: float(entry.text or "nan") for entry in card if entry.tag != "elastic"}
    assert value["density"] == pytest.approx(9.6e-10)
    np.testing.assert_allclose([value[f"t{index}"] for index in range(1, 7)], material.relaxation_time(20.0), rtol=1e-8)
    assert (
        files(formats=["febio"], hyperelastic="neo-hookean", temperature="20 degC", density="0.96 g/cm^3", units="mm-t-s")
        == written
    )


def test_mistakes_in_keys_that_contradict_each_other_come_at_once() -> None:
    with pytest.raises(InputError) as caught:
        check(ExportSection, {"formats": ["febio", "febio"], "bulk_modulus": "2 GPa", "poisson_ratio": 0.4}, "r.toml", Path())
    assert [line.split(": ")[1] for line in caught.value.messages] == ["bulk_modulus", "formats must differ"]
