from __future__ import annotations

import json
import re
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from processes import Run

from dielast import __file__ as package, __version__
from dielast.commands.registry import COMMANDS
from dielast.io.table import parse_csv

Starter = Callable[[str], Path]
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]\d+)?")
FITTED = ["equilibrium.shear_modulus", "nonequilibrium.scale"]
# of the tables without a golden recipe
HEADERS = {
    "electrode.csv": [
        *("file", "time [s]", "centre_x [px]", "centre_y [px]", "major_axis [px]", "minor_axis [px]", "angle [deg]"),
        *("relative_stretch_1 [1]", "relative_stretch_1_stderr [1]", "relative_stretch_2 [1]", "relative_stretch_2_stderr [1]"),
        *("area_strain [1]", "state"),
    ],
    "parameters.csv": ["parameter", "start", "value", "standard_error", "lower", "upper", "verdict", "unit"],
    "tests.csv": [
        *("test", "used", "points", "rms_error", "rms_relative_error [1]", "r_squared [1]", "coverage [1]", "specimen", "unit"),
        *("specimen_factor [1]", "rms_voltage_error [1]", "slack_points [1]", "left_out_points [1]"),
    ],
    "correlations.csv": ["parameter", *(f"{name} [1]" for name in FITTED)],
    "residuals.csv": ["test", "time [s]", "measured", "model", "lower", "upper", "unit"],
    "profiles.csv": ["parameter", "value", "rise [1]"],
    "next_tests.csv": ["test", "variance_removed [1]"],
    "laws.csv": [
        *("material", "equilibrium_law", "nonequilibrium_law", "parameters", "rms_relative_error [1]", "r_squared [1]"),
        *("cross_validation_error [1]", "aic [1]", "aicc [1]", "stable_to_uniaxial [1]", "stable_to_equibiaxial [1]"),
        "stable_to_pure_shear [1]",
    ],
    "draws.csv": [
        *("draw", "equilibrium_shear_modulus [Pa]", "C1 [1]", "C2 [K]", "shear_modulus_1 [Pa]", "shear_modulus_2 [Pa]"),
        *("relaxation_time_1 [s]", "relaxation_time_2 [s]"),
    ],
}
TEXT = {"failure_mode", "reached", "event", "parameter", "verdict", "unit", "test", "used", "specimen", "material"}
TEXT |= {"equilibrium_law", "nonequilibrium_law", "file", "state"}
TEXT |= {"law", "scatter", "suspended"}
# empty where one law is fitted, of a test with few points, and of a test that is predicted
TEXT |= {"cross_validation_error [1]", "aicc [1]", "specimen_factor [1]"}
FILES = {
    "mastercurve": {"mastercurve.csv", "shift-factors.csv", "mastercurve.png", "summary.toml"},
    "measure": {"electrode.csv", "measure.png", "photographs.png", "summary.toml"},
    "spectrum": {"spectrum.csv", "fit.csv", "material.toml", "spectrum.png", "summary.toml"},
    "calibrate": {
        *("parameters.csv", "tests.csv", "correlations.csv", "residuals.csv", "profiles.csv", "laws.csv", "draws.csv"),
        *("next_tests.csv", "material.toml", "calibrate.png", "summary.toml"),
    },
    "relax": {"relax.csv", "cases.csv", "relax.png", "summary.toml"},
    "creep": {"creep.csv", "cases.csv", "creep.png", "summary.toml"},
    "actuate": {"actuate.csv", "events.csv", "cases.csv", "actuate.png", "summary.toml"},
    "failure-map": {"failure-map.csv", "fit.csv", "failure-map.png", "summary.toml"},
    "lifetime": {
        *("parameters.csv", "specimens.csv", "life.csv", "laws.csv", "lines.csv", "material.toml", "draws.csv", "lifetime.png"),
        "summary.toml",
    },
    "design": {"design.csv", "design.png", "summary.toml"},
}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.mark.parametrize("kind", COMMANDS)
def test_the_starter_runs_as_it_is(kind: str, dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter(kind)
    assert dielast("validate", recipe).stdout == f"{recipe}: ok\n"
    if kind == "lifetime":  # its fits are those of fewer voltages and draws
        text = recipe.read_text()
        recipe.write_text(text.replace("points = 7", "points = 2").replace("draws = 100", "draws = 20"))
        assert len(recipe.read_text()) == len(text) - 1
    if kind == "calibrate":  # all its constants are fitted in the guide, own-material.md
        text = recipe.read_text()
        less = text.replace('"nonequilibrium.relaxation_time" = {}', "").replace("starts = 8", "starts = 1")
        assert len(less) < len(text) - 30
        recipe.write_text(less.replace("nonequilibrium.shear_modulus", "nonequilibrium.scale").replace("draws = 60", "draws = 20"))
    formats = {f"{kind}.{form}" for form in ("png", "svg", "pdf")} if kind == "relax" else set()
    plots = [word for name in sorted(formats) for word in ("--plot", name.partition(".")[2])]
    done = dielast(kind, recipe, "-o", "out", *plots)
    assert (done.returncode, done.stderr) == (0, "")
    first = contents(tmp_path / "out")
    assert set(first) == FILES[kind] | formats
    assert first[f"{kind}.png"].startswith(b"\x89PNG")
    for name, content in first.items():
        assert str(tmp_path).encode() not in content
        if name.endswith(".csv"):
            cells = parse_csv(content, name)
            if kind in ("measure", "calibrate"):  # columns of lifetime depend on its laws: test_lifetime
                assert list(cells) == HEADERS[name]
            assert set(cells.get("reached", [])) <= {"yes"}  # the goal of a design
            assert b"\r" not in content
            # a film that outlives the horizon has no time, a specimen no voltage
            numbers = [
                cell
                for header, column in cells.items()
                if header not in TEXT
                for cell in column
                if cell or ("time_to" not in header and "voltage_error" not in header and kind != "lifetime")
            ]
            assert all(NUMBER.fullmatch(cell) for cell in numbers)
    if kind == "mastercurve":  # dielast ships what its starter makes, for the starter of spectrum
        shipped = contents(Path(str(package)).parent / "examples/mastercurve")
        for name in ("mastercurve.csv", "shift-factors.csv"):
            for column, values in parse_csv(shipped[name], name).items():
                np.testing.assert_allclose(
                    np.array(parse_csv(first[name], name)[column], float), np.array(values, float), rtol=1e-6
                )
    summary = tomllib.loads(first["summary.toml"].decode())
    assert summary["version"] == __version__
    assert all(len(entry["sha256"]) == 64 for entry in summary["inputs"])


def test_results_go_to_a_folder_named_after_the_recipe(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter("spectrum")
    done = dielast("spectrum", recipe, "--plot", "none")
    assert set(contents(tmp_path / "spectrum")) == FILES["spectrum"] - {"spectrum.png"}
    assert "fit.branches = 30\n" in done.stdout
    assert dielast("spectrum", recipe, "--plot", "none", "-q").stdout == ""


def test_the_summary_is_printed_as_json(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    done = dielast("spectrum", starter("spectrum"), "--json", "--plot", "none", "--set", "fit.branches=13")
    assert json.loads(done.stdout) == tomllib.loads((tmp_path / "spectrum/summary.toml").read_text())
    assert json.loads(done.stdout)["fit"]["branches"] == 13


def test_golden_files_are_compared_cell_by_cell(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter("spectrum")
    golden = ["spectrum", recipe, "--plot", "none", "-q", "--golden", "golden"]
    dielast("spectrum", recipe, "--plot", "none", "-o", "golden")
    assert dielast(*golden).returncode == 0
    table = tmp_path / "golden/spectrum.csv"
    rows = table.read_text().splitlines()
    time, modulus = rows[3].split(",")
    rows[3] = f"{time},{float(modulus) * 1.00001:.9g}"
    table.write_text("\n".join(rows) + "\n")
    done = dielast(*golden)
    assert done.returncode == 4
    *lines, changed = done.stderr.splitlines()
    assert changed.startswith("warning: golden: spectrum.csv is not the file that its run wrote")
    assert lines == [
        f"spectrum.csv: shear_modulus [Pa]: 1 of 30 cells differs: row 4: {modulus}; golden {float(modulus) * 1.00001:.9g}, "
        "relative difference 1e-05",
        "1 difference from golden beyond a relative 1e-06",
    ]
    assert dielast(*golden, "--rtol", "1e-4").returncode == 0
    table.write_text("\n".join(rows[:-1]) + "\n")
    assert "spectrum.csv: 30 rows; golden 29" in dielast(*golden).stderr
    table.unlink()
    assert "spectrum.csv: not among the golden files" in dielast(*golden).stderr
    summary = tmp_path / "golden/summary.toml"
    summary.write_text(summary.read_text().replace("branches = 30", "branches = 31"))
    assert "summary.toml: fit.branches: 30.0; golden 31.0" in dielast(*golden).stderr
    assert dielast("spectrum", recipe, "--golden", "nowhere").returncode == 2


def test_a_depfile_names_everything_read(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter("mastercurve")
    (tmp_path / "my data.csv").write_bytes((Path(__file__).parents[2] / "dielast/examples/relaxation-test.csv").read_bytes())
    recipe.write_text(recipe.read_text().replace("example:relaxation-test.csv", "my data.csv"))
    assert dielast("mastercurve", recipe, "--plot", "none", "--depfile", "deps/m.d", "-q").returncode == 0
    rule = (tmp_path / "deps/m.d").read_text()
    assert rule.startswith("mastercurve/shift-factors.csv mastercurve/mastercurve.csv mastercurve/summary.toml: ")
    assert "mastercurve.toml \\\n  my\\ data.csv\n" in rule
    done = dielast("mastercurve", recipe, "--plot", "none", "--depfile", "deps/m.d", "-o", "a;b", "-q")
    assert done.returncode == 2
    assert "make cannot hold ';'" in done.stderr
    assert not (tmp_path / "a;b").exists()  # refused before the computation
    (tmp_path / "my;data.csv").write_bytes((tmp_path / "my data.csv").read_bytes())
    recipe.write_text(recipe.read_text().replace("my data.csv", "my;data.csv"))
    assert dielast("mastercurve", recipe, "--plot", "none", "--depfile", "deps/m.d", "-o", "new", "-q").returncode == 2
    assert not (tmp_path / "new").exists()


def test_a_chain_goes_from_measurements_to_a_material(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    dielast("mastercurve", starter("mastercurve"), "--plot", "none", "-o", "out/mc")
    recipe = starter("spectrum")
    recipe.write_text(recipe.read_text().replace("example:mastercurve", "out/mc"))
    done = dielast("spectrum", recipe, "--plot", "none", "-o", "out/sp")
    assert done.returncode == 0, done.stderr
    assert dielast("validate", "out/sp/material.toml").returncode == 0
    summary = tomllib.loads((tmp_path / "out/mc/summary.toml").read_text())
    material = tomllib.loads((tmp_path / "out/sp/material.toml").read_text())
    assert material["shift"]["C1"] == summary["shift"]["C1"]
    assert material["reference_temperature"] == "20 degC"
    assert material["nonequilibrium"]["J_lim"] == 55


def table(rows: str) -> str:
    return "temperature [degC],time [s],relaxation_modulus [Pa]\n" + rows


GOOD = "\n".join(f"{T},{t},{1e6 * (t * 10 ** (T / 40)) ** -0.3:.6g}" for T in (0, 20) for t in (1, 2, 4, 8, 16, 32, 64))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, 'data.file: "dma.csv": no such file'),
        (table(GOOD).replace("20,4,", "20,four,"), 'dma.csv: line 11: column "time": "four" is not a finite number'),
        (
            table(GOOD).replace("0,1,", "0,0,"),
            'dma.csv: line 2: time is not above zero: if the test begins with a ramp, state its duration, such as ramp = "1 s"',
        ),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(
    content: str | None, message: str, dielast: Run, starter: Starter, tmp_path: Path
) -> None:
    recipe = starter("mastercurve")
    text = recipe.read_text().replace("example:relaxation-test.csv", "dma.csv")
    recipe.write_text(text.replace('ramp = "1 s"', ""))
    if content is not None:
        (tmp_path / "dma.csv").write_text(content)
    before = {path.name for path in tmp_path.iterdir()}
    done = dielast("mastercurve", recipe)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["mastercurve", "gone.toml"], 2, "gone.toml: no such file\n"),
        (["mastercurve", "."], 2, ".: is a folder, a file is needed\n"),
        (["mastercurve"], 2, "missing argument"),
        (["mastercurv"], 2, 'dielast: no command "mastercurv": did you mean "mastercurve"? (see dielast --help)'),
        (["actuator", "x.toml"], 2, 'dielast: no command "actuator": did you mean "actuate"?'),
        (["map"], 2, 'dielast: no command "map": did you mean "failure-map"?'),
        (
            ["nothing"],
            2,
            'dielast: no command "nothing": one of mastercurve, measure, spectrum, calibrate, relax, creep, actuate, failure-map, ',
        ),
        (["new", "nothing"], 2, '"nothing" is no kind of recipe: one of mastercurve, measure, spectrum, calibrate, relax, creep, '),
        (["new", "actuator"], 2, '"actuator" is no kind of recipe: did you mean "actuate"?\n'),
        (["new", "Failure_Map"], 2, '"Failure_Map" is no kind of recipe: did you mean "failure-map"?\n'),
        (
            ["new"],
            2,
            "dielast new: a kind is needed: mastercurve, measure, spectrum, calibrate, relax, creep, actuate, failure-map, life",
        ),
        (["--plot"], 2, "dielast: no such option: --plot"),
        (["relax", "--bogus"], 2, "dielast relax: no such option: --bogus"),
        (["spectrum", "x.toml", "--plot", "bmp"], 2, "dielast spectrum: invalid value for '--plot': 'bmp' is not one of 'png', "),
        (["creep", "x.toml", "--jobs", "0"], 2, "dielast creep: invalid value for '--jobs': at least 1 is needed (see "),
        (["creep", "x.toml", "--jobs", "x"], 2, "dielast creep: invalid value for '--jobs': a whole number is needed (see "),
        (["creep", "x.toml", "--rtol", "x"], 2, "dielast creep: invalid value for '--rtol': a number is needed (see "),
        (["creep", "x.toml", "--rtol", "-1"], 2, "dielast creep: invalid value for '--rtol': at least 0 is needed (see "),
        (["actuate"], 2, "dielast actuate: missing argument 'RECIPE.toml' (see dielast actuate --help)"),
        (["relax", "x.toml", "-o"], 2, "'-o' requires an argument"),
        (["relax", "x.toml", "--out="], 2, "is empty, a name is needed (see dielast relax --help)"),
        (["relax", "x.toml", "y.toml"], 2, "dielast relax: got unexpected extra argument"),
    ],
)
def test_wrong_usage_exits_with_2(arguments: list[str], code: int, message: str, dielast: Run) -> None:
    done = dielast(*arguments)
    assert done.returncode == code
    assert message in done.stderr
    assert (done.stdout, done.stderr.count("\n")) == ("", 1)


def test_a_command_without_arguments_gets_the_help(dielast: Run) -> None:
    done = dielast()
    assert done.returncode == 2
    assert "Usage: dielast" in done.stdout + done.stderr


@pytest.mark.parametrize("out", ["taken", "taken/deeper/still"])
def test_an_output_folder_that_is_a_file_is_told_before_work_is_done(
    dielast: Run, starter: Starter, tmp_path: Path, out: str
) -> None:
    (tmp_path / "taken").write_text("precious")
    done = dielast("spectrum", starter("spectrum"), "-o", out)
    assert done.returncode == 2
    assert done.stderr == "taken: is a file, a folder for the results is needed (see --out)\n"
    assert (tmp_path / "taken").read_text() == "precious"


def test_version_help_and_schema(dielast: Run) -> None:
    assert dielast("--version").stdout.startswith(f"dielast {__version__}")
    for arguments in (["--help"], ["mastercurve", "-h"], ["spectrum", "--help"]):
        assert "Usage: " in dielast(*arguments).stdout
    schema = json.loads(dielast("schema").stdout)
    assert len(schema["oneOf"]) == len(COMMANDS)


def test_validate_tells_every_mistake_of_every_recipe(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text('kind = "spectrum"\nmastercurve = "nowhere"\nfitt = 3\n')
    done = dielast("validate", starter("spectrum"), bad, "gone.toml")
    assert done.returncode == 2
    assert done.stdout.endswith("spectrum.toml: ok\n")
    assert done.stderr.splitlines() == [
        f'{bad}: mastercurve: "nowhere" does not exist; run the recipe that makes it (dielast mastercurve)',
        f'{bad}: fitt: unknown key; did you mean "fit"?',
        "gone.toml: no such file",
    ]


def test_start_up_loads_nothing_heavy(dielast: Run) -> None:
    import sys

    code = "import sys; sys.argv = ['dielast', '--help']\nfrom dielast.cli import main\ntry: main()\nexcept SystemExit: pass\n"
    code += "print(sorted({'numpy', 'scipy', 'pandas', 'matplotlib', 'rich'} & sys.modules.keys()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_golden_files_and_inputs_are_never_overwritten(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter("spectrum")
    assert dielast("spectrum", recipe, "--plot", "none", "-o", "gg").returncode == 0
    done = dielast("spectrum", recipe, "--plot", "none", "-o", "gg", "--golden", "gg")
    assert (done.returncode, done.stderr) == (
        2,
        "gg: the result would overwrite the golden files; write it to another folder (see --out)\n",
    )
    done = dielast("spectrum", recipe, "--plot", "none", "-o", "new", "--golden", "new")
    assert done.returncode == 2
    assert not (tmp_path / "new").exists()
    text = recipe.read_text()
    done = dielast("spectrum", recipe, "--plot", "none", "--depfile", recipe)
    assert done.returncode == 2
    assert "is an input of this run" in done.stderr
    assert recipe.read_text() == text
    (tmp_path / "fit.csv").write_text(table(GOOD))
    (tmp_path / "mc.toml").write_text(
        'kind = "spectrum"\n[data]\nfile = "fit.csv"\ncolumns = { time = "time", modulus = "relaxation_modulus" }\n'
        'reference_temperature = "20 degC"\n[fit]\nmethod = "nnls"\nbranches = 3\n'
    )
    done = dielast("spectrum", "mc.toml", "-o", ".", "--plot", "none")
    assert done.returncode == 2
    assert "fit.csv: is an input of this run" in done.stderr
    assert (tmp_path / "fit.csv").read_text() == table(GOOD)


@pytest.mark.parametrize("title", ["long " * 80 + "$x^{$", "Price $5 and 10 % for $6, 50 µm, 20 °C"])
def test_any_title_is_drawn_as_it_stands(title: str, dielast: Run, starter: Starter, tmp_path: Path) -> None:
    done = dielast("creep", starter("creep"), "-q", "--set", f"title={title}")
    assert (done.returncode, done.stderr) == (0, "")


def test_the_users_matplotlib_settings_do_not_leak_in(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter("creep")
    assert dielast("creep", recipe, "-q", "-o", "plain").returncode == 0
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\nfont.size: 30\nfigure.facecolor: red\n")
    assert dielast("creep", recipe, "-q", "-o", "own", fresh=True).returncode == 0
    assert contents(tmp_path / "plain") == contents(tmp_path / "own")


def test_a_folder_in_the_way_of_a_result_leaves_all_as_it_was(dielast: Run, starter: Starter, tmp_path: Path) -> None:
    recipe = starter("spectrum")
    (tmp_path / "o/fit.csv").mkdir(parents=True)
    done = dielast("spectrum", recipe, "-q", "-o", "o")
    assert (done.returncode, done.stderr) == (2, "o/fit.csv: is a folder, a file is to be written there\n")
    assert [path.name for path in (tmp_path / "o").iterdir()] == ["fit.csv"]
