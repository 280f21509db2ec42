"""Cases with draws: whose error it is, and what a material without branches has to do with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from dielast.cli.run import compute
from dielast.errors import InputError
from dielast.recipe.cases import read_cases
from dielast.sharing.execution import Execution

RELAX = 'kind = "relax"\nmaterial = "m.toml"\n[[step]]\nstretch = 1.5\nrate = "5 %/s"\n[output]\npoints_per_decade = 2\n'
HEAD = 'reference_temperature = "20 degC"\ndraws = "draws.csv"\nequilibrium = { shear_modulus = "26 kPa" }\n'


def run(folder: Path, recipe: str) -> dict[str, bytes]:
    path = folder / "r.toml"
    path.write_text(recipe)
    return compute("relax", read_cases(path), path, (), Execution())[0]


def test_draws_of_an_elastic_material(tmp_path: Path) -> None:
    branches = 'nonequilibrium = { relaxation_time_s = [], shear_modulus_Pa = [] }\nshift = { law = "none" }\n'
    (tmp_path / "m.toml").write_text(HEAD + branches)
    rows = "".join(f"{k},{26000 + 10 * k}\n" for k in range(-12, 12))
    (tmp_path / "draws.csv").write_text("draw,equilibrium_shear_modulus [Pa]\n" + rows.replace("-", "1"))
    files = run(tmp_path, RELAX + "[uncertainty]\n")
    assert b"nominal_stress_1_upper [Pa]" in files["relax.csv"]


def test_an_error_of_a_draw_names_the_case(tmp_path: Path) -> None:
    """At -170 degC, below the pole of one draw's shift law but not of the material's."""
    branches = "nonequilibrium = { relaxation_time_s = [10.0], shear_modulus_Pa = [1e4] }\n"
    (tmp_path / "m.toml").write_text(HEAD + branches + 'shift = { law = "wlf", C1 = 13.7, C2 = "200 K" }\n')
    header = "draw,equilibrium_shear_modulus [Pa],C1 [1],C2 [K],shear_modulus_1 [Pa],relaxation_time_1 [s]\n"
    rows = "".join(f"{k},26000,13.7,{180 if k == 17 else 200},1e4,10\n" for k in range(24))
    (tmp_path / "draws.csv").write_text(header + rows)
    with pytest.raises(InputError) as caught:
        run(tmp_path, RELAX + '[uncertainty]\n[sweep]\ntemperature = ["20 degC", "0 degC", "-170 degC"]\n')
    (line,) = caught.value.messages
    assert line.startswith(f"{tmp_path / 'r.toml'}: case 2: uncertainty: in a draw: temperature: -170 degC")
