from __future__ import annotations

import tomllib
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from readings import relaxation_curves

from dielast import RelaxationCurve, build_master_curve
from dielast.base.errors import DielastWarning, InputError
from dielast.cli.run import compute
from dielast.commands.mastercurve.recipe import MasterCurveRecipe
from dielast.commands.mastercurve.run import run
from dielast.commands.registry import read_cases
from dielast.io.files import Inputs
from dielast.readings.read import read_all
from dielast.readings.recipe import MeasurementData
from dielast.recipe.cases import Case
from dielast.sharing.execution import Execution

COLUMNS = {"temperature": "T", "time": "t", "modulus": "E"}
TIME = np.geomspace(1, 100, 12)


def rows(temperature: float, factor: float = 1.0) -> list[str]:
    return [f"{temperature},{t!r},{factor * 1e6 * (t * 10 ** (temperature / 20)) ** -0.3!r}" for t in TIME.tolist()]


def read(folder: Path, lines: list[str], **options: object) -> list[RelaxationCurve]:
    (folder / "dma.csv").write_text("\n".join(["T [degC],t [s],E [Pa]", *lines]) + "\n")
    data = MeasurementData.model_validate({"file": "dma.csv", "columns": COLUMNS, **options}, context={"folder": folder})
    return relaxation_curves(data, Inputs(folder))


def test_a_clock_that_runs_on_is_noticed(tmp_path: Path) -> None:
    """Not that of tests which begin anew, in windows that overlap, or only touch for some of the temperatures."""
    late = [f"0,{t + 150!r},{1e6 * t**-0.1!r}" for t in TIME.tolist()]
    with pytest.warns(DielastWarning, match="at 20 degC up to 100 s, at 0 degC from 151 s on: if the clock runs on"):
        read(tmp_path, rows(20) + late)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path, rows(20) + late + rows(40))


def test_thermostat_scatter_is_one_temperature(tmp_path: Path) -> None:
    scatter = np.random.default_rng(2).uniform(-0.2, 0.2, 12)
    lines = [f"{20 + d:.3f}" + row[row.index(",") :] for d, row in zip(scatter, rows(20), strict=True)]
    found = read(tmp_path, rows(0) + lines)
    assert len(found) == 2
    assert found[1].temperature == pytest.approx(20, abs=0.2)
    creeping = [f"{T / 10},{t},{1e6}" for T in range(0, 60, 3) for t in (1, 2, 4)]
    with pytest.raises(InputError, match="run into one another"):
        read(tmp_path, creeping)


def test_files_state_their_temperature_in_a_list_or_in_their_name(tmp_path: Path) -> None:
    for temperature, kelvin in ((0, 273.15), (20, 293.15)):
        text = "t [s],E [Pa]\n" + "\n".join(row.split(",", 1)[1] for row in rows(temperature))
        (tmp_path / f"run_{temperature}C.csv").write_text(text)
        (tmp_path / f"abs_{kelvin}K.csv").write_text(text)
    columns = {"time": "t", "modulus": "E"}
    for options in (
        {"files": ["run_20C.csv", "run_0C.csv"], "temperatures": ["20 degC", "273.15 K"]},
        {"files": "run_*.csv", "temperature_in_name": "run_{degC}C"},
        {"files": "abs_*.csv", "temperature_in_name": "abs_{K}K"},
    ):
        data = MeasurementData.model_validate({"columns": columns, **options}, context={"folder": tmp_path})
        found = relaxation_curves(data, Inputs(tmp_path))
        assert [round(curve.temperature, 6) for curve in found] == [0, 20]
    data = MeasurementData.model_validate(
        {"columns": columns, "files": "run_*.csv", "temperature_in_name": "x{degC}"}, context={"folder": tmp_path}
    )
    with pytest.raises(InputError, match="the name does not fit"):
        relaxation_curves(data, Inputs(tmp_path))


def summary_of(folder: Path, lines: list[str], **options: object) -> tuple[Any, np.ndarray]:
    """The headline of a run, and the standard errors of its shift factors."""
    (folder / "dma.csv").write_text("\n".join(["T [degC],t [s],E [Pa]", *lines]) + "\n")
    recipe = MasterCurveRecipe.model_validate(
        {
            "kind": "mastercurve",
            "data": {"file": "dma.csv", "columns": COLUMNS, "test": "tension", **options},
            "shift": {"reference_temperature": "20 degC", "law": "table"},
        },
        context={"folder": folder},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        report = run([Case(recipe, {})], Inputs(folder), Execution())
    return report.headline, np.array(next(c.values for c in report.tables["shift-factors.csv"] if c.name.endswith("stderr")))


def bent(temperature: float) -> list[str]:
    """A relaxation modulus that bends, so that there is a shift to be told from an offset."""
    reduced = TIME * 10 ** (temperature / 20)
    return [f"{temperature},{t!r},{1e5 + 1e7 / (1 + u)!r}" for t, u in zip(TIME.tolist(), reduced.tolist(), strict=True)]


def test_thermometer_and_drift_are_in_the_standard_errors_and_in_the_summary(tmp_path: Path) -> None:
    lines = bent(0) + bent(10) + bent(20) + bent(30) + bent(40)
    default, own = summary_of(tmp_path, lines)
    assert default["data"]["temperature_stderr_K"] == 0.3
    assert "drift" not in default["data"]
    exact = summary_of(tmp_path, lines, temperature_stderr="0 K")[1]
    assert np.all(exact < 1e-3)
    # log10 a falls by 1/20 a kelvin, at this temperature and at the reference temperature
    np.testing.assert_allclose(np.delete(own, 2), np.sqrt(2) * 0.3 / 20, rtol=0.02)


def test_a_reference_temperature_in_kelvin_with_the_unit_of_celsius_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "dma.csv").write_text("\n".join(["T [degC],t [s],E [Pa]", *bent(0), *bent(20), *bent(40)]) + "\n")
    data = {"file": "dma.csv", "columns": COLUMNS, "test": "tension"}
    for stated, noticed in (("298 degC", True), ("298 K", False)):
        recipe = {"kind": "mastercurve", "data": data, "shift": {"reference_temperature": stated, "law": "arrhenius"}}
        case = Case(MasterCurveRecipe.model_validate(recipe, context={"folder": tmp_path}), {})
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", DielastWarning)
            run([case], Inputs(tmp_path), Execution())
        assert any("298 degC: was the value in kelvin" in str(one.message) for one in caught) == noticed


def test_a_drift_follows_the_order_of_the_file(tmp_path: Path) -> None:
    """As the specimen was measured, not as its temperatures are sorted."""
    (tmp_path / "dma.csv").write_text("\n".join(["T [degC],t [s],E [Pa]", *bent(40), *bent(0), *bent(20)]) + "\n")
    data = MeasurementData.model_validate({"file": "dma.csv", "columns": COLUMNS, "test": "tension"}, context={"folder": tmp_path})
    reading = read_all(data, Inputs(tmp_path))
    assert [curve.temperature for curve in reading.measurements] == [0, 20, 40]
    assert [curve.temperature for curve in reading.in_order] == [40, 0, 20]


@pytest.mark.parametrize(("key", "value"), [("temperature_stderr", "-0.1 K"), ("temperature_stderr", "0.1"), ("drift", "200 %")])
def test_what_is_stated_wrongly_is_refused(tmp_path: Path, key: str, value: str) -> None:
    with pytest.raises(ValueError, match="is needed"):
        summary_of(tmp_path, bent(0) + bent(20), **{key: value})
    with pytest.raises(InputError, match="temperature_stderr: -1 K"):
        build_master_curve([], reference_temperature=20.0, temperature_stderr=-1.0)
    with pytest.raises(InputError, match="drift: 2: a share"):
        build_master_curve([], reference_temperature=20.0, drift=2.0)


ABSCISSA = np.logspace(-1, 2, 16)
TEMPERATURES = (0.0, 10.0, 20.0, 30.0)


def recipe_of(folder: Path, columns: str, header: str, *values: Any, shift: str = "") -> Path:
    """A recipe_of and its data: `values` of the abscissa are measured, 20 degC and below slower by a decade in 20 K."""
    lines = [header]
    for temperature in TEMPERATURES:
        scale = 10 ** ((20 - temperature) / 20)
        for x in ABSCISSA.tolist():
            reduced = x * scale if "w [rad/s]" in header else x / scale
            lines.append(",".join(f"{number:.9g}" for number in (temperature, x, *(value(reduced) for value in values))))
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    path = folder / "recipe.toml"
    path.write_text(
        f'kind = "mastercurve"\n[data]\nfile = "data.csv"\ncolumns = {{ temperature = "T", {columns} }}\n'
        f'[shift]\nreference_temperature = "20 degC"\n{shift}\n'
    )
    return path


def sweeps(folder: Path, shift: str = "") -> Path:
    def storage(x: float) -> float:
        return 1e5 * x**2 / (1 + x**2) + 1e3

    def loss(x: float) -> float:
        return 1e5 * x / (1 + x**2)

    columns = 'angular_frequency = "w", storage = "S", loss = "L"'
    return recipe_of(folder, columns, "T [degC],w [rad/s],S [Pa],L [Pa]", storage, loss, shift=shift)


def creep(folder: Path, shift: str = "") -> Path:
    def compliance(x: float) -> float:
        return 1e-6 * (x**0.3 + 0.2 * x**0.9)

    return recipe_of(folder, 'time = "t", compliance = "J"', "T [degC],t [s],J [1/Pa]", compliance, shift=shift)


def run_recipe(path: Path, *plots: str) -> tuple[dict[str, bytes], dict[str, Any]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        found = compute("mastercurve", read_cases(path, "mastercurve", ()), path, plots, Execution())[0]
    return found, tomllib.loads(found["summary.toml"].decode())


def test_a_recipe_may_say_what_to_shift_on(tmp_path: Path) -> None:
    for on in ("moduli", "tan-delta", "storage"):
        _, summary = run_recipe(sweeps(tmp_path, f'on = "{on}"'))
        assert (summary["data"]["measurement"], summary["shift"]["on"]) == ("oscillation", on)
    found, summary = run_recipe(creep(tmp_path), "svg")
    assert found["mastercurve.svg"].startswith(b"<?xml")
    assert summary["data"]["measurement"] == "creep"
    assert "on" not in summary["shift"]
