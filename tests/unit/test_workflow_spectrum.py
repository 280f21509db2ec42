"""`spectrum` from curves of every kind: what is read, what is written, what is refused."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast import Plateaus
from dielast.base.errors import DielastWarning, InputError
from dielast.commands.spectrum.recipe import CurveData, SpectrumRecipe
from dielast.commands.spectrum.run import run
from dielast.commands.spectrum.sources import read_curve
from dielast.io.files import Inputs
from dielast.io.table import number_columns, to_csv
from dielast.material.spectrum import Spectrum
from dielast.recipe.cases import Case
from dielast.relaxation.fit import fit_spectrum
from dielast.relaxation.interconversion import retardation_from_relaxation
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution

Array = NDArray[np.float64]
TRUTH = Spectrum(np.logspace(3, -4, 8), np.array([1e4, 3e4, 2e4, 9e4, 4e5, 3e5, 8e5, 2e6]))
LEVEL = 5e4
FREQUENCY = np.logspace(-5, 6, 111)
TIME = np.logspace(-7, 6, 131)
MEASURED: dict[str, tuple[str, list[Array]]] = {
    "relaxation": ("reduced_time [s],relaxation_modulus [Pa]", [TIME, 3 * TRUTH.relaxation_modulus(TIME, LEVEL)]),
    "oscillation": (
        "angular_frequency [rad/s],reduced_angular_frequency [rad/s],storage_modulus [Pa],loss_modulus [Pa]",
        [FREQUENCY, FREQUENCY, 3 * TRUTH.storage_modulus(FREQUENCY, LEVEL), 3 * TRUTH.loss_modulus(FREQUENCY)],
    ),
    "creep": (
        "time [s],reduced_time [s],creep_compliance [1/Pa]",
        [TIME, TIME, retardation_from_relaxation(TRUTH, LEVEL).creep_compliance(TIME) / 3],
    ),
}


def with_temperature(header: str, columns: list[Array]) -> str:
    """A table of measured points as `mastercurve` writes it."""
    return table(f"temperature [degC],{header}", [np.linspace(60, -20, columns[0].size), *columns])


def table(header: str, columns: list[Array]) -> str:
    return "\n".join([header, *(",".join(f"{value:.9g}" for value in row) for row in np.transpose(columns))]) + "\n"


def write_folder(folder: Path, measurement: str, data: str | None = None) -> Path:
    """A folder as `mastercurve` writes it."""
    folder.mkdir()
    data = f'[data]\nmeasurement = "{measurement}"\n' if data is None else data
    shift = 'reference_temperature_degC = 20.0\nlaw = "wlf"\nC1 = 13.7\nC2_K = 187.1\n'
    (folder / "summary.toml").write_text(f'kind = "mastercurve"\n[shift]\n{shift}{data}')
    (folder / "mastercurve.csv").write_text(with_temperature(*MEASURED[measurement]))
    return folder


def spectrum(folder: Path, **document: Any) -> RunReport:
    recipe = SpectrumRecipe.model_validate({"kind": "spectrum", **document}, context={"folder": folder})
    return run([Case(recipe, {})], Inputs(folder), Execution())


@pytest.mark.parametrize("measurement", MEASURED)
@pytest.mark.parametrize("data", [None, ""])
def test_a_folder_of_any_measurement_is_fitted(tmp_path: Path, measurement: str, data: str | None) -> None:
    if data == "" and measurement != "relaxation":
        data = f'[data]\nmeasurement = "{measurement}"\n'
    write_folder(tmp_path / "mc", measurement, data)
    method = {"method": "nnls"} if measurement == "relaxation" else {}
    report = spectrum(tmp_path, mastercurve="mc", fit={"branches": 24, **method})
    content = to_csv(report.tables["spectrum.csv"])
    tau, mu = number_columns(content, "spectrum.csv", ["relaxation_time [s]", "shear_modulus [Pa]"])
    time = np.logspace(-4, 3, 30)
    found = Spectrum(tau, mu).relaxation_modulus(time, report.headline["moduli"]["equilibrium_shear_Pa"])
    np.testing.assert_allclose(found, TRUTH.relaxation_modulus(time, LEVEL), rtol=0.02)
    headers = [column.header for column in report.tables["fit.csv"]]
    assert (
        headers
        == {
            "relaxation": ["reduced_time [s]", "measured [Pa]", "model [Pa]"],
            "oscillation": [
                "reduced_angular_frequency [rad/s]",
                "measured_storage [Pa]",
                "model_storage [Pa]",
                "measured_loss [Pa]",
                "model_loss [Pa]",
            ],
            "creep": ["reduced_time [s]", "measured [1/Pa]", "model [1/Pa]"],
        }[measurement]
    )
    columns = number_columns(to_csv(report.tables["fit.csv"]), "fit.csv", headers)
    assert np.all(np.diff(columns[0]) > 0)
    np.testing.assert_allclose(columns[2], columns[1], rtol=0.1)
    assert report.headline["fit"]["method"] == "nnls"
    assert b"C1 = 13.7" in report.files["material.toml"]
    assert report.figure().axes


@pytest.mark.parametrize("factor", ["-13.57", "0.0"])
def test_shift_constants_that_no_material_file_may_state_are_refused(tmp_path: Path, factor: str) -> None:
    summary = write_folder(tmp_path / "mc", "creep") / "summary.toml"
    summary.write_text(summary.read_text().replace("C1 = 13.7", f"C1 = {factor}"))
    with pytest.raises(InputError, match=r"mc/summary.toml: shift.C1: .* above 0 is needed; .* correct the temperatures"):
        spectrum(tmp_path, mastercurve="mc")


@pytest.mark.parametrize(("undetermined", "measured"), [("", b'[\n    "-20 degC",\n    "60 degC"'), ("60.0, -20.0", b"59.38")])
def test_temperatures_without_a_shift_factor_of_their_own_are_not_where_the_law_was_measured(
    tmp_path: Path, undetermined: str, measured: bytes
) -> None:
    data = f'[data]\nmeasurement = "creep"\nundetermined_temperatures_degC = [{undetermined}]\n'
    write_folder(tmp_path / "mc", "creep", data)
    assert measured in spectrum(tmp_path, mastercurve="mc").files["material.toml"]


def test_a_folder_without_results_is_named_with_its_key(tmp_path: Path) -> None:
    (tmp_path / "mc").mkdir()
    with pytest.raises(InputError, match=r"mc/summary.toml: no such file: mastercurve must be a folder that .* wrote"):
        spectrum(tmp_path, mastercurve="mc")


def test_an_unknown_measurement_and_a_missing_column_are_refused(tmp_path: Path) -> None:
    write_folder(tmp_path / "one", "creep", '[data]\nmeasurement = "torsion"\n')
    with pytest.raises(InputError, match='measurement is "torsion": a folder written by mastercurve is needed'):
        spectrum(tmp_path, mastercurve="one")
    write_folder(tmp_path / "two", "creep", '[data]\nmeasurement = "oscillation"\n')
    with pytest.raises(InputError, match=r'column "reduced_angular_frequency \[rad/s\]" is missing'):
        spectrum(tmp_path, mastercurve="two")


@pytest.mark.parametrize("measurement", ["oscillation", "creep"])
def test_schwarzl_and_staverman_read_a_relaxation_modulus_only(tmp_path: Path, measurement: str) -> None:
    write_folder(tmp_path / "mc", measurement)
    with pytest.raises(InputError, match=f'"schwarzl-staverman" reads a relaxation modulus; {measurement} needs "nnls"'):
        spectrum(tmp_path, mastercurve="mc", fit={"method": "schwarzl-staverman"})


def read(folder: Path, header: str, values: list[Array], **data: Any) -> tuple[Array, ...]:
    (folder / "curve.csv").write_text(table(header, values))
    document = {"file": "curve.csv", "reference_temperature": "20 degC", **data}
    return read_curve(CurveData.model_validate(document, context={"folder": folder}), Inputs(folder)).columns


def test_tables_from_elsewhere(tmp_path: Path) -> None:
    x, y, z = np.array([1.0, 2.0, 4.0]), np.array([3.0, 5.0, 7.0]), np.array([0.5, 0.25, 0.1])
    found = read(tmp_path, "f [Hz],E1 [kPa],tan", [x, y, z], columns={"frequency": "f", "storage": "E1", "tan_delta": "tan"})
    np.testing.assert_allclose(found, [2 * np.pi * x, 1e3 * y, 1e3 * y * z])
    names = {"angular_frequency": "w", "storage": "G1", "loss": "G2"}
    found = read(tmp_path, "w [rad/s],G1 [Pa],G2 [Pa]", [x, y, z], columns=names, test="shear")
    np.testing.assert_allclose(found, [x, 3 * y, 3 * z])
    found = read(tmp_path, "time [s],J [1/MPa]", [x, z], columns={"compliance": "J"}, test="shear")
    np.testing.assert_allclose(found, [x, 1e-6 * z / 3])
    found = read(tmp_path, "time [min],modulus [Pa]", [x, y])
    np.testing.assert_allclose(found, [60 * x, y])


def test_continuous_and_reduced_spectra_are_written(tmp_path: Path) -> None:
    write_folder(tmp_path / "mc", "oscillation")
    window = {"window": ["1 s", "1 h"], "temperatures": ["20 degC", "40 degC"], "tolerance": 0.02}
    with pytest.warns(DielastWarning, match="falls apart into 8 pieces"):  # the truth is eight lines
        report = spectrum(tmp_path, mastercurve="mc", fit={"continuous": True}, reduce=window)
    assert [column.header for column in report.tables["continuous-spectrum.csv"]] == ["relaxation_time [s]", "H [Pa]"]
    proof = report.headline["reduce"]
    assert proof["max_relative_error"] <= proof["tolerance"] == 0.02
    tau, mu = (column.values for column in report.tables["spectrum.csv"])
    assert len(tau) == len(mu) == proof["branches"] < 10
    assert report.headline["fit"]["branches"] == 55
    temperature, _, full, reduced = (np.asarray(column.values, dtype=float) for column in report.tables["reduction.csv"])
    assert np.unique(temperature).tolist() == [20, 40]
    assert np.abs(reduced / full - 1).max() == pytest.approx(proof["max_relative_error"])
    assert report.headline["continuous"]["integral_Pa"] == pytest.approx(TRUTH.shear_modulus.sum(), rel=0.1)
    labels = report.figure().axes[0].get_legend_handles_labels()[1]
    assert f"reduced to {proof['branches']}" in labels
    assert any("continuous" in label for label in labels)


@pytest.mark.parametrize(
    ("reduce", "found"),
    [
        ({"window": ["6 h", "1 s"]}, "the shorter time must come first"),
        ({"window": ["1 s"]}, "at least 2"),
        ({"window": ["1 s", "6 h"], "tolerance": 0}, "greater than 0"),
        ({"window": ["1 s", "6 h"], "temperatures": ["-170 degC"]}, "reduce.temperatures: -170 degC is at or below -167.1 degC"),
        ({"window": ["1 s", "2 s"], "tolerance": 1e-7}, "reduce.tolerance: 1e-07"),
    ],
)
def test_impossible_reductions_are_refused(tmp_path: Path, reduce: dict[str, Any], found: str) -> None:
    write_folder(tmp_path / "mc", "oscillation")
    with pytest.raises(ValueError, match=found):
        spectrum(tmp_path, mastercurve="mc", reduce=reduce)


def test_truncate_and_reduce_exclude_each_other(tmp_path: Path) -> None:
    write_folder(tmp_path / "mc", "oscillation")
    with pytest.raises(ValueError, match="both select branches"):
        spectrum(tmp_path, mastercurve="mc", truncate={"keep": 3}, reduce={"window": ["1 s", "6 h"]})


@pytest.mark.parametrize(
    ("window", "at", "found"),
    [
        (["1 s", "1e6 s"], ["20 degC", "60 degC"], r"reaches to 2.59e\+08 s at 60 degC in reduced time, .* from 1e-06 to 1e\+05 s"),
        (["1e-5 s", "1e5 s"], ["20 degC", "-20 degC"], r"reaches from \S+ s at -20 degC in reduced time"),
        (["1e-8 s", "1e7 s"], ["20 degC"], r"reaches to 1e\+07 s at 20 degC and from 1e-08 s at 20 degC in reduced time"),
    ],
)
def test_a_window_beyond_what_was_measured_is_warned_of(tmp_path: Path, window: list[str], at: list[str], found: str) -> None:
    write_folder(tmp_path / "mc", "oscillation")
    with pytest.warns(DielastWarning, match=found):
        spectrum(tmp_path, mastercurve="mc", reduce={"window": window, "temperatures": at, "tolerance": 0.2})


def test_a_creep_curve_has_no_continuous_spectrum_says_the_key(tmp_path: Path) -> None:
    write_folder(tmp_path / "mc", "creep")
    with pytest.raises(InputError, match=r"^fit\.continuous: a creep curve"):
        spectrum(tmp_path, mastercurve="mc", fit={"continuous": True})


def test_cards_say_what_a_spectrum_was_reduced_for(tmp_path: Path) -> None:
    write_folder(tmp_path / "mc", "oscillation")
    reduce = {"window": ["1 s", "100 s"], "temperatures": ["10 degC", "20 degC"], "tolerance": 0.05}
    export = {"formats": ["abaqus", "febio"], "temperature": "15 degC"}
    report = spectrum(tmp_path, mastercurve="mc", reduce=reduce, export=export)
    for name in ("material.inp", "material.feb"):
        card = report.files[name].decode()
        assert "Reduced from 55 to " in card
        assert "from 1 to 100 s at 10, 20 degC" in card
    with pytest.warns(DielastWarning, match="export.temperature: 40 degC is outside of reduce.temperatures"):
        spectrum(tmp_path, mastercurve="mc", reduce=reduce, export={**export, "temperature": "40 degC"})
    with pytest.warns(DielastWarning, match="branches of zero modulus"):
        report = spectrum(tmp_path, mastercurve="mc", truncate={"keep": 29}, export={"formats": ["abaqus"]})
    card = report.files["material.inp"].decode()
    assert "** Truncated to the 29 slowest branches" in card


@pytest.mark.parametrize(
    ("measurement", "document", "message"),
    [
        (
            "relaxation",
            {"fit": {"glassy_modulus": "1 kPa"}},
            "fit.glassy_modulus: 1000 Pa is below the start of the curve, ",
        ),
        (
            "creep",
            {"fit": {"glassy_modulus": "1 kPa", "equilibrium_modulus": "150 kPa"}},
            "fit.equilibrium_modulus: 150000 Pa must be smaller than fit.glassy_modulus = 1000 Pa",
        ),
        (
            "relaxation",
            {"fit": {"method": "schwarzl-staverman", "branches": 2}},
            "fit.branches: 2: schwarzl-staverman needs at least 3",
        ),
    ],
)
def test_mistakes_name_the_key_of_the_recipe(tmp_path: Path, measurement: str, document: dict[str, Any], message: str) -> None:
    write_folder(tmp_path / "mc", measurement)
    with pytest.raises(InputError) as caught:
        spectrum(tmp_path, mastercurve="mc", **document)
    (line,) = caught.value.messages
    assert line.startswith(message)


@pytest.mark.parametrize("test", ["relaxation", "oscillation", "creep"])
def test_a_liquid_has_no_equilibrium_modulus_and_nothing_is_said_of_a_plateau(tmp_path: Path, test: str) -> None:
    """A melt whose curve ends on the plateau of its entanglements."""
    folder = write_folder(tmp_path / "curve", test)
    recipe = {"kind": "spectrum", "mastercurve": str(folder), "fit": {"method": "nnls"}}

    def told(**fit: Any) -> tuple[float, list[str]]:
        own = SpectrumRecipe.model_validate(recipe | {"fit": recipe["fit"] | fit})
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            report = run([Case(own, {})], Inputs(tmp_path), Execution())
        return report.headline["moduli"]["equilibrium_shear_Pa"], [str(one.message) for one in caught]

    level, said = told(liquid=True)
    assert level == 0
    assert not [one for one in said if "levelled off" in one]
    assert [one for one in told(equilibrium_modulus="0 Pa")[1] if "levelled off" in one]


def test_a_liquid_with_an_equilibrium_modulus_is_a_contradiction() -> None:
    fit = {"liquid": True, "equilibrium_modulus": "20 kPa"}
    with pytest.raises(ValueError, match="liquid = true and an equilibrium_modulus above 0 contradict each other"):
        SpectrumRecipe.model_validate({"kind": "spectrum", "mastercurve": "out", "fit": fit})
    with pytest.raises(InputError, match="that of a liquid is 0"):
        fit_spectrum(TIME, 3 * TRUTH.relaxation_modulus(TIME, LEVEL), plateaus=Plateaus(equilibrium_modulus=6e4, liquid=True))
