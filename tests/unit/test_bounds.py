"""Cases with draws: whose error it is, and what a material without branches has to do with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from films import SOFT

from dielast.base.errors import InputError
from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.commands.simulation.bounds import bounded
from dielast.commands.simulation.result import CaseResult
from dielast.handover.material_file import write_material
from dielast.io.table import number_columns
from dielast.material.intervals import DrawIntervals
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


TIME = np.linspace(0.0, 9.0, 10)


def film(rate: float, rows: int) -> CaseResult:
    """A film that grows at this rate, and of which so many rows are known."""
    time = TIME[:rows]
    columns = {"time [s]": time, "stretch_1 [1]": 1 + rate * time, "stability [1]": 1 - rate * time}
    return CaseResult(20.0, {**columns, "nominal_stress_1 [Pa]": np.full(rows, 1e4)}, None)


def test_a_film_that_has_failed_is_beyond_every_upper_bound() -> None:
    """Of 39 films, the faster one grows the earlier it fails, two at a time."""
    rates = np.linspace(0.09, 0.01, 39)
    ends = np.minimum(2 + np.arange(39) // 2, 10)
    drawn = [film(rate, rows) for rate, rows in zip(rates.tolist(), ends.tolist(), strict=True)]
    central = film(0.05, 10)
    columns = bounded(central, drawn, DrawIntervals(0.9), [True] * 39).columns
    low, high, share = (columns[name] for name in ("stretch_1_lower [1]", "stretch_1_upper [1]", "surviving [1]"))
    lost = np.array([np.sum(ends <= row) for row in range(10)])
    assert share == pytest.approx(1 - lost / 39)
    # the second of 39 from either end bounds 90 %: with two failed there is no upper bound
    assert np.array_equal(np.isfinite(high), lost < 2)
    assert high[:2] == pytest.approx(1 + rates[1] * TIME[:2])
    # the slowest survive them all: their bound is that of all films
    assert low == pytest.approx(1 + rates[37] * TIME)
    # what runs down to the failure is bounded from above to the end, by those that survive the longest
    low, high = columns["stability_lower [1]"], columns["stability_upper [1]"]
    assert np.array_equal(np.isfinite(low), lost < 2)
    assert high == pytest.approx(1 - rates[37] * TIME)


def test_the_interval_of_films_of_which_some_fail_holds_its_own_curve(tmp_path: Path) -> None:
    """Thin films fail first: those that survive grow less than the film that is drawn, and bounded it from below."""
    (tmp_path / "m.toml").write_bytes(write_material(SOFT))
    path = tmp_path / "r.toml"
    path.write_text(
        """
kind = "actuate"
material = "m.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.5
[[step]]
voltage = "6 kV"
[[step]]
hold = "1 h"
[breakdown]
field = "50 MV/m"
[output]
points_per_decade = 5
[uncertainty]
draws = 60
thickness = "5 %"
"""
    )
    content = compute("actuate", read_cases(path), path, (), Execution())[0]["actuate.csv"]
    names = ["relative_stretch_1 [1]", "relative_stretch_1_lower [1]", "relative_stretch_1_upper [1]", "surviving [1]"]
    own, low, high, surviving = number_columns(content, "actuate.csv", names)
    assert surviving[-1] < 0.9
    assert np.all(low[surviving >= 0.1] <= own[surviving >= 0.1])
    there = ~np.isnan(high)
    assert np.all(own[there] <= high[there])
    # the bound of 95 % of the films ends with the film that is the 58th of 60
    assert np.array_equal(there, surviving > 57.5 / 60)
