"""A test at one temperature makes a material by itself: `spectrum` reads what `mastercurve` reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from readings import table

from dielast.base.errors import DielastWarning, InputError
from dielast.commands.mastercurve.recipe import MasterCurveRecipe
from dielast.commands.mastercurve.run import run as run_mastercurve
from dielast.commands.registry import read_cases
from dielast.commands.spectrum.recipe import CurveData
from dielast.commands.spectrum.run import run as run_spectrum
from dielast.commands.spectrum.sources import read_curve
from dielast.handover.mastercurve_folder import ReducedCurve
from dielast.io.files import Inputs
from dielast.material.shift import NoShift
from dielast.recipe.cases import Case
from dielast.recipe.validate import check
from dielast.sharing.execution import Execution

TIME = np.geomspace(1.0, 1e4, 80)
MODULUS = 1e5 * (1 + np.exp(-TIME[:, None] / np.array([3.0, 30.0, 300.0])).sum(axis=1))
SPECIMEN = {"gauge_length": "80 mm", "width": "6 mm", "thickness": "0.5 mm"}
AREA, GAUGE, STRAIN = 6e-3 * 0.5e-3, 80e-3, 0.02


def read(folder: Path, **data: Any) -> ReducedCurve:
    return read_curve(check(CurveData, data, "recipe.toml: data", folder), Inputs(folder))


def held(folder: Path, header: str, *columns: Any) -> Path:
    path = folder / "test.csv"
    path.write_text(table(header, np.column_stack([np.broadcast_to(column, TIME.shape) for column in columns])))
    return path


@pytest.mark.parametrize(
    ("header", "scales", "columns"),
    [
        ("time [s],strain [%],stress [kPa]", (100 * STRAIN, STRAIN * MODULUS / 1e3), {"strain": "strain", "stress": "stress"}),
        (
            "time [s],ext [mm],load [mN]",
            (1e3 * STRAIN * GAUGE, 1e3 * STRAIN * MODULUS * AREA),
            {"extension": "ext", "force": "load"},
        ),
        ("time [s],strain [1],load [N]", (STRAIN, STRAIN * MODULUS * AREA), {"strain": "strain", "force": "load"}),
        ("time [s],ext [in],stress [Pa]", (STRAIN * GAUGE / 0.0254, STRAIN * MODULUS), {"extension": "ext", "stress": "stress"}),
        ("time [s],x,modulus [MPa]", (0.0, MODULUS / 1e6), {"modulus": "modulus"}),
    ],
)
def test_stress_and_strain_force_and_extension_or_a_modulus_are_one_curve(
    tmp_path: Path, header: str, scales: tuple[Any, Any], columns: dict[str, str]
) -> None:
    held(tmp_path, header, TIME, *scales)
    found = read(tmp_path, file="test.csv", columns=columns, specimen=SPECIMEN, reference_temperature="23 degC")
    assert found.kind.name == "relaxation"
    assert found.shift == NoShift(23.0)
    np.testing.assert_allclose(found.columns, [TIME, MODULUS], rtol=1e-12)


def test_a_test_that_begins_at_zero_states_its_ramp(tmp_path: Path) -> None:
    """The extension shows how long it took."""
    time = np.concatenate((np.linspace(0, 2, 5), TIME[TIME > 2]))
    force = 1e3 * STRAIN * AREA * np.minimum(time / 2 + 0.01, 1)
    rows = np.column_stack((time, 1e3 * STRAIN * GAUGE * np.minimum(time / 2, 1), force))
    (tmp_path / "test.csv").write_text(table("t [s],u [mm],F [N]", rows))
    columns = {"time": "t", "extension": "u", "force": "F"}
    with pytest.raises(InputError, match=r'line 2: .*here until the extension is reached: ramp = "2 s"'):
        read(tmp_path, file="test.csv", columns=columns, specimen=SPECIMEN, reference_temperature="23 degC")


def test_creep_of_a_machine_is_a_compliance(tmp_path: Path) -> None:
    stress = 1e4
    held(tmp_path, "t [min],u [mm],F [N]", TIME / 60, 1e3 * GAUGE * stress / MODULUS[::-1], stress * AREA)
    columns = {"time": "t", "extension": "u", "force": "F"}
    options = {"file": "test.csv", "columns": columns, "specimen": SPECIMEN, "reference_temperature": "23 degC"}
    found = read(tmp_path, **options, measurement="creep")
    assert found.kind.name == "creep"
    np.testing.assert_allclose(found.columns, [TIME, 1 / MODULUS[::-1]], rtol=1e-12)
    with pytest.warns(DielastWarning, match='as in creep: state measurement = "creep"'):
        read(tmp_path, **options)


def test_the_temperature_is_stated_once(tmp_path: Path) -> None:
    rows = np.column_stack((20 + 0.1 * np.sin(TIME), TIME, MODULUS))
    (tmp_path / "test.csv").write_text(table("T [degC],time [s],E [Pa]", rows))
    options: dict[str, Any] = {"file": "test.csv", "columns": {"temperature": "T", "modulus": "E"}}
    assert read(tmp_path, **options).shift.reference_temperature == pytest.approx(rows[:, 0].mean(), abs=1e-5)
    assert read(tmp_path, **options, reference_temperature="20 degC").shift.reference_temperature == 20
    with pytest.raises(
        InputError, match=r"test.csv: the test was at 20.* degC, but reference_temperature is 60 degC: leave one out"
    ):
        read(tmp_path, **options, reference_temperature="60 degC")
    with pytest.raises(InputError, match=r'test.csv: the data state no temperature: state reference_temperature = "20 degC"'):
        read(tmp_path, file="test.csv", columns={"modulus": "E"})
    with pytest.raises(InputError, match=r"data: temperature: the temperature of the test is reference_temperature"):
        read(tmp_path, **options, temperature="20 degC")
    rows[40:, 0] += 20
    (tmp_path / "test.csv").write_text(table("T [degC],time [s],E [Pa]", rows))
    several = 'and a spectrum is made of one temperature: "dielast mastercurve" joins several'
    with pytest.warns(DielastWarning, match="if the clock runs on"), pytest.raises(InputError, match=several):
        read(tmp_path, **options)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (
            TIME > 5e3,
            "line 76: the relaxation modulus at 23 degC is zero or negative here, and in 5 more rows, where",
        ),
        (np.arange(80) == 9, "line 11: the relaxation modulus at 23 degC is zero or negative amid large values, which is no noise"),
    ],
)
def test_values_below_zero_are_left_out_and_their_rows_named(tmp_path: Path, wrong: np.ndarray, said: str) -> None:
    """Those of a noise floor, and those that cannot be one."""
    held(tmp_path, "time [s],modulus [Pa]", TIME, MODULUS * np.where(wrong, -1e-3 if wrong[-1] else -1.0, 1.0))
    with pytest.warns(DielastWarning, match=f"test.csv: {said}"):
        found = read(tmp_path, file="test.csv", reference_temperature="23 degC")
    np.testing.assert_array_equal(found.columns[0], TIME[~wrong])


@pytest.mark.parametrize("column", [True, False])
def test_both_ways_to_refuse_one_temperature_say_what_takes_it(tmp_path: Path, column: bool) -> None:
    rows = np.column_stack((np.full(TIME.shape, 20.0), TIME, MODULUS))
    (tmp_path / "test.csv").write_text(table("T [degC],time [s],E [Pa]", rows))
    columns = {"modulus": "E", **({"temperature": "T"} if column else {})}
    document = {"kind": "mastercurve", "data": {"file": "test.csv", "columns": columns}}
    document["shift"] = {"reference_temperature": "20 degC"}
    recipe = MasterCurveRecipe.model_validate(document, context={"folder": tmp_path})
    with pytest.raises(InputError) as caught:
        run_mastercurve([Case(recipe, {})], Inputs(tmp_path), Execution())
    said = 'of a test at one temperature "dielast spectrum" makes a material: kind = "spectrum", the same [data] with'
    assert said in str(caught.value)


def test_what_is_advised_is_a_recipe(tmp_path: Path) -> None:
    """Both ways, taken at their word."""
    rows = np.column_stack((np.full(TIME.shape, 20.0), TIME, MODULUS))
    (tmp_path / "test.csv").write_text(table("T [degC],time [s],E [Pa]", rows))
    for columns in ('{ modulus = "E" }', '{ temperature = "T", modulus = "E" }'):
        recipe = tmp_path / "recipe.toml"
        recipe.write_text(
            f'kind = "spectrum"\n[data]\nfile = "test.csv"\ncolumns = {columns}\nreference_temperature = "20 degC"\n'
            '[fit]\nmethod = "nnls"\n'
        )
        assert run_spectrum(read_cases(recipe), Inputs(tmp_path), Execution()).files
