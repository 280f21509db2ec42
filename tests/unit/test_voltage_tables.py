"""Tables as loads: of voltages and of what they do to a film, and those that dielast wrote."""

from __future__ import annotations

import contextlib
import io
import warnings
from pathlib import Path

import numpy as np
import pytest

from dielast.base.errors import DielastWarning, InputError
from dielast.cli.run import compute
from dielast.commands.plan import warnings_of
from dielast.commands.registry import read_cases
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs
from dielast.io.table import number_columns
from dielast.mechanics.load import Track
from dielast.readings.quantities import check_area_strain
from dielast.sharing.execution import Execution

FILM = 'kind = "actuate"\nmaterial = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\n[[step]]\n'


def followed(folder: Path, step: str) -> list[tuple[list[float], list[float]]]:
    """Times in s and voltages in V of the tracks."""
    (folder / "r.toml").write_text(FILM + step)
    (case,) = read_cases(folder / "r.toml")
    tracks = [entry.step.target for entry in solver_steps(case.recipe, Inputs(folder)) if isinstance(entry.step.target, Track)]
    return [(np.asarray(track.time).tolist(), np.asarray(track.value).tolist()) for track in tracks]


def test_columns_of_a_voltage_table_can_be_named(tmp_path: Path) -> None:
    (tmp_path / "v.csv").write_text("t [ms],U1 [kV],U2 [kV]\n0,0,0\n2000,1,2\n4000,0,0\n")
    columns = 'columns = { time = "t", voltage = "U2" }\n'
    assert followed(tmp_path, f'table = "v.csv"\n{columns}') == [([0.0, 2.0, 4.0], [0.0, 2000.0, 0.0])]
    with pytest.raises(InputError, match=r'^step\[0\]\.columns\.time: v\.csv: no column "time" for time'):
        followed(tmp_path, 'table = "v.csv"\n')
    with pytest.raises(InputError, match=r"step\[0\]: columns goes with table$"):
        followed(tmp_path, f'hold = "1 s"\n{columns}')


def test_a_sheet_of_a_workbook_can_be_a_voltage_table(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    book = openpyxl.Workbook()
    book.active.append(["notes"])
    sheet = book.create_sheet("Voltage")
    for row in (["time [s]", "voltage [kV]"], [0.0, 0.0], [1.0, 2.5], [3.0, 0.5]):
        sheet.append(row)
    content = io.BytesIO()
    book.save(content)
    (tmp_path / "v.xlsx").write_bytes(content.getvalue())
    assert followed(tmp_path, 'table = "v.xlsx"\nsheet = "Voltage"\n') == [([0.0, 1.0, 3.0], [0.0, 2500.0, 500.0])]
    (tmp_path / "v.csv").write_text("time [s],voltage [V]\n0,0\n1,1\n")
    with pytest.raises(InputError, match=r'^step\[0\]\.table: v\.csv: sheet = "Voltage" is stated, but this is no workbook$'):
        followed(tmp_path, 'table = "v.csv"\nsheet = "Voltage"\n')


CALIBRATE = """
kind = "calibrate"
material = "example:vhb4905.toml"
[[test]]
file = "film.csv"
film = { thickness = "1 mm", prestretch = 2.0, boundary = "frame", electrode_share = 0.25 }
ramp = "20 V/s"
columns = { voltage = "V", MEASURE = "HEADER" }
[free]
"equilibrium.shear_modulus" = {}
"""
COMPARE = (
    FILM
    + """voltage = "2 kV"
rate = "20 V/s"
[[compare]]
file = "film.csv"
x = "voltage [V]"
x_column = "V"
y = "MEASURE [1]"
y_column = "HEADER"
"""
)


@pytest.mark.parametrize(
    ("recipe", "measure", "header", "values", "message"),
    [
        (CALIBRATE, "area_strain", "A/A0", (1.0, 1.01, 1.05, 1.08), ""),
        (CALIBRATE, "area_strain", "dA [1]", (0.0, 0.01, 0.05, 0.08), ""),
        (CALIBRATE, "relative_stretch", "L/L0", (1.0, 1.01, 1.05, 1.08), ""),
        (
            CALIBRATE,
            "relative_stretch",
            "A/A0",
            (1.0, 1.01, 1.05, 1.08),
            'column "A/A0" holds areas, .*: state columns.area_strain',
        ),
        (CALIBRATE, "stretch", "area strain", (0.0, 0.01, 0.05, 0.08), 'column "area strain" holds areas, .* columns.area_strain'),
        (
            CALIBRATE,
            "area_strain",
            "L/L0",
            (1.0, 1.01, 1.05, 1.08),
            'column "L/L0" holds lengths, .*: state columns.stretch or columns.rel.*',
        ),
        (
            CALIBRATE,
            "area_strain",
            "area [1]",
            (1.0, 1.01, 1.05, 1.08),
            'column "area" is 1 at the lowest voltage, .*: call a column of ratios .*',
        ),
        (COMPARE, "area_strain", "A/A0", (1.0, 1.01, 1.05, 1.08), ""),
        (
            COMPARE,
            "relative_stretch_1",
            "A/A0",
            (1.0, 1.01, 1.05, 1.08),
            '.* holds areas, .* compare it with "area_strain \\[1\\]", .*',
        ),
        (
            COMPARE,
            "area_strain",
            "lambda",
            (1.0, 1.01, 1.05, 1.08),
            '.* holds lengths, .* compare it with "relative_stretch_1 \\[1\\]"',
        ),
        (COMPARE, "area_strain", "ratio", (1.0, 1.01, 1.05, 1.08), 'column "ratio" is 1 at the lowest voltage, .*'),
        (COMPARE.replace('y_column = "HEADER"\n', ""), "area_strain", "area_strain [%]", (0.0, 1.0, 5.0, 8.0), ""),
        (CALIBRATE, "area_strain", "A/A0 [%]", (100.0, 101.0, 105.0, 108.0), ""),
        (CALIBRATE, "relative_stretch", "A/A0 / %", (100.0, 101.0, 105.0, 108.0), 'column "A/A0 / %" holds areas, .*'),
    ],
)
def test_areas_and_lengths_of_a_film_are_told_apart(
    recipe: str, measure: str, header: str, values: tuple[float, ...], message: str, tmp_path: Path
) -> None:
    rows = [f"{volt},{value}" for volt, value in zip((0, 1000, 2000, 2500), values, strict=True)]
    (tmp_path / "film.csv").write_text("\n".join([f"V [V],{header}", *rows]))
    (tmp_path / "r.toml").write_text(recipe.replace("MEASURE", measure).replace("HEADER", header))
    if not message:
        warnings_of(tmp_path / "r.toml")
        return
    with pytest.raises(InputError, match=f"film.csv: {message}$"):
        warnings_of(tmp_path / "r.toml")


@pytest.mark.parametrize(
    ("voltage", "strain", "ratios"),
    [
        ((4e3, 5e3, 6e3), (0.70, 1.00, 1.58), False),
        ((6e3, 6e3), (1.58, 1.60), False),
        ((0.0, 0.0), (1.0, 1.0), False),
        ((0.0, 1e3, 2e3, 3e3), (0.0, 1.2, 1.3, 1.35), False),  # a film that snaps through
        ((0.9e3, 3e3), (1.01, 1.09), True),
        ((-3e3, -1.5e3, 0.0), (1.4, 1.1, 1.0), True),
        ((0.0, 1e3, 2e3, 2.5e3), (1.0, 1.05, 1.2, 2.6), True),  # up to pull-in
        ((), (), False),
    ],
)
def test_ratios_of_areas_are_those_that_begin_at_1_without_a_voltage(
    voltage: tuple[float, ...], strain: tuple[float, ...], ratios: bool
) -> None:
    expected = pytest.raises(InputError, match="call a column of ratios") if ratios else contextlib.nullcontext()
    with expected:
        check_area_strain(np.array(voltage), np.array(strain), "area", "film.csv")


MATERIAL = """
name = "two branches"
reference_temperature = "20 degC"
equilibrium = { shear_modulus = "26 kPa", J_lim = 110.0 }
nonequilibrium = { J_lim = 55.0, relaxation_time_s = [40.0, 2.0], shear_modulus_Pa = [1e4, 4e4] }
shift = { law = "none" }
"""

STRETCHED = '[[step]]\nstretch = 1.5\nrate = "5 %/s"\n[[step]]\nhold = "1 min"\n[[step]]\nstretch = 1.2\n[[step]]\nhold = "10 s"\n'
LOADED = '[[step]]\nstress = "20 kPa"\n[[step]]\nhold = "1 min"\n[[step]]\nstress = "5 kPa"\n[[step]]\nhold = "10 s"\n'
COARSE = "[output]\npoints_per_decade = 20\n"
FOLLOWED = f'[[step]]\ntable = "first.csv"\n{COARSE}'


def write(folder: Path, kind: str, text: str) -> Path:
    (folder / "material.toml").write_text(MATERIAL)
    path = folder / f"{kind}.toml"
    path.write_text(f'kind = "{kind}"\nmaterial = "material.toml"\n{text}')
    return path


def run(folder: Path, kind: str, text: str) -> bytes:
    """The table of a run."""
    path = write(folder, kind, text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        return compute(kind, read_cases(path), path, (), Execution())[0][f"{kind}.csv"]


def once(content: bytes, header: str) -> dict[float, float]:
    """The values over time, without the two at a jump."""
    time, values = number_columns(content, "result", ["time [s]", header])
    found, count = np.unique(time, return_counts=True)
    known = dict(zip(time.tolist(), values.tolist(), strict=True))
    return {each: known[each] for each in found[count == 1].tolist()}


@pytest.mark.parametrize(
    ("kind", "steps", "measured", "digits"),
    [
        ("relax", f'slack = "pushes"\n{STRETCHED}', "nominal_stress_1 [Pa]", 2e-3),
        # straight lines between the lengths of the slack specimen
        pytest.param("relax", STRETCHED, "nominal_stress_1 [Pa]", 20.0, marks=pytest.mark.trust),
        ("creep", LOADED, "stretch_1 [1]", 0.0),
    ],
)
def test_a_result_drives_the_same_run_again(tmp_path: Path, kind: str, steps: str, measured: str, digits: float) -> None:
    (tmp_path / "first.csv").write_bytes(run(tmp_path, kind, steps + COARSE))
    slack = steps[: steps.index("[[step]]")]
    first = once((tmp_path / "first.csv").read_bytes(), measured)
    again = once(run(tmp_path, kind, slack + FOLLOWED), measured)
    assert len(first) > 200
    # `digits` is what the last one of the load's stands for
    np.testing.assert_allclose([again[time] for time in first], list(first.values()), rtol=1e-6, atol=digits)


def test_the_stretch_of_creep_asks_for_its_stress(tmp_path: Path) -> None:
    (tmp_path / "first.csv").write_bytes(run(tmp_path, "creep", f"{LOADED}{COARSE}"))
    stress = once(run(tmp_path, "relax", FOLLOWED), "nominal_stress_1 [Pa]")
    held = [value for time, value in stress.items() if 1 < time < 60]
    assert len(held) > 20
    np.testing.assert_allclose(held, 20e3, rtol=2e-3)  # straight lines between the points


@pytest.mark.parametrize("kind", ["relax", "creep"])
def test_the_simple_name_goes_first(tmp_path: Path, kind: str) -> None:
    own, simple = ("stretch_1 [1]", "stretch [1]") if kind == "relax" else ("nominal_stress_1 [Pa]", "stress [Pa]")
    path = write(tmp_path, kind, FOLLOWED)
    targets = {}
    for header in (f"{own},{simple}", own, simple):
        rows = "1,1.5,1.25\n2,2,3\n" if "," in header else "1,1.5\n2,2\n"
        (tmp_path / "first.csv").write_text(f"time [s],{header}\n{rows}")
        (entry,) = solver_steps(read_cases(path)[0].recipe, Inputs(tmp_path))
        assert isinstance(entry.step.target, Track)
        targets[header] = list(entry.step.target.value)
    assert list(targets.values()) == [[1.25, 3.0], [1.5, 2.0], [1.5, 2.0]]


def test_several_cases_are_no_load(tmp_path: Path) -> None:
    sweep = '[sweep]\ntemperature = ["20 degC", "30 degC"]\n[output]\ntimes = ["1 s", "2 s"]\n'
    (tmp_path / "first.csv").write_bytes(run(tmp_path, "relax", STRETCHED + sweep))
    said = r"^step\[0\].table: first.csv: line 4: case 0 ends and case 1 begins, so that times do not ascend: a load is one case"
    with pytest.raises(InputError, match=said):
        solver_steps(read_cases(write(tmp_path, "relax", FOLLOWED))[0].recipe, Inputs(tmp_path))


def test_a_voltage_that_jumps_is_followed(tmp_path: Path) -> None:
    film = 'material = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\nrelax = "10 min"\n'
    hold = '[[step]]\nhold = "20 s"\n'
    steps = f'[[step]]\nvoltage = "2 kV"\nduration = "5 s"\n{hold}[[step]]\nvoltage = "1 kV"\n{hold}'
    path = tmp_path / "actuate.toml"

    def films(text: str) -> bytes:
        path.write_text(f'kind = "actuate"\n{film}{text}')
        return compute("actuate", read_cases(path), path, (), Execution())[0]["actuate.csv"]

    (tmp_path / "first.csv").write_bytes(films(f"{steps}[output]\npoints_per_decade = 5\n"))
    first, again = (once(content, "stretch_1 [1]") for content in ((tmp_path / "first.csv").read_bytes(), films(FOLLOWED)))
    assert len(first) > 60
    np.testing.assert_allclose([again[time] for time in first], list(first.values()), rtol=1e-6)
    (tmp_path / "first.csv").write_text("time [s],voltage [V]\n1,100\n1,200\n")
    with pytest.raises(InputError, match=r"first\.csv: line 3: time 1 s does not come after 1 s"):
        films(FOLLOWED)
