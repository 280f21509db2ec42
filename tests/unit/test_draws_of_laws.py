"""Draws of one material whose springs have different laws: written as a table and read again."""

from dataclasses import replace

import numpy as np
import pytest

from dielast import Gent, InputError, Material, MooneyRivlin, NeoHookean, NoShift, Ogden, Spectrum, Yeoh
from dielast.handover.material_draws import draw_columns, parse_draws
from dielast.io.table import to_csv
from dielast.material.material import numbers_of

BASE = Material("film", 2e4, Spectrum([100.0, 3.0], [2e4, 4e4]), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=4e-11)


def test_draws_keep_their_laws() -> None:
    draws = [
        replace(BASE, equilibrium_law=Gent(80.0)),
        replace(BASE, equilibrium_law=MooneyRivlin(8e3, 2e3), nonequilibrium_law=NeoHookean()),
        replace(BASE, equilibrium_law=Gent(120.0), equilibrium_modulus=3e4),
        replace(BASE, equilibrium_law=Yeoh(1e4, -20.0, 1.0), nonequilibrium_law=Yeoh(0.5, 0.01, 0.0)),
        replace(BASE, equilibrium_law=Ogden((1.5e4, 2e3), (1.8, 3.0)), equilibrium_modulus=16.5e3),
    ]
    content = to_csv(draw_columns(np.arange(len(draws)), draws))
    for draw, found in zip(draws, parse_draws(content, "draws.csv", BASE), strict=True):
        assert type(found.equilibrium_law) is type(draw.equilibrium_law)
        assert type(found.nonequilibrium_law) is type(draw.nonequilibrium_law)
        stated, kept = numbers_of(draw), numbers_of(found)
        for section in ("equilibrium", "nonequilibrium"):
            for key, value in stated[section].items():
                assert np.allclose(kept[section][key], value), (section, key)


@pytest.mark.parametrize(
    ("row", "cell", "wrong"),
    [
        (3, "mooney-rivlin", "mooney-rivlyn"),
        (4, "120", "-120"),
        (4, "120", "many"),
        (2, "80", "many"),
        (4, "30000", "-30000"),
    ],
)
def test_a_mistake_in_a_draw_is_named_by_its_row(row: int, cell: str, wrong: str) -> None:
    draws = [
        replace(BASE, equilibrium_law=Gent(80.0)),
        replace(BASE, equilibrium_law=MooneyRivlin(8e3, 2e3)),
        replace(BASE, equilibrium_law=Gent(120.0), equilibrium_modulus=3e4),
    ]
    lines = to_csv(draw_columns(np.arange(len(draws)), draws)).decode().splitlines()
    assert f",{cell}," in lines[row - 1] + ","
    lines[row - 1] = (lines[row - 1] + ",").replace(f",{cell},", f",{wrong},")[:-1]
    with pytest.raises(InputError) as caught:
        parse_draws("\n".join(lines).encode(), "draws.csv", BASE)
    assert [(problem.file, problem.row) for problem in caught.value.problems] == [("draws.csv", row)]
