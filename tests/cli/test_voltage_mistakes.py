"""What is wrong with a film or with a table of load is told by file, key, case and line."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from dielast.commands.actuate import run as actuate
from dielast.commands.grids import failure_map
from dielast.commands.membrane import run as relax
from dielast.commands.registry import read_cases
from dielast.errors import InputError
from dielast.io.files import Inputs, read_file, resolve
from dielast.sharing.execution import Execution

Run = Callable[..., subprocess.CompletedProcess[str]]
WORKFLOWS = {"actuate": actuate, "failure-map": failure_map, "relax": relax}
ACTUATE = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "1 s"
[[step]]
voltage = "4 kV"
[breakdown]
field = "48 MV/m"
"""
MAP = """
kind = "failure-map"
material = "example:vhb4905.toml"
horizon = "1 s"
[film]
thickness = "0.5 mm"
prestretch = [1.7, 1.8]
[voltage]
values = ["3 kV"]
[breakdown]
field = "45 MV/m"
"""
RELAX = """
kind = "relax"
material = "example:vhb4905.toml"
[[step]]
stretch = 2.0
rate = "1 %/s"
"""
TABLE = ACTUATE.replace('voltage = "4 kV"', 'table = "load.csv"')
HEAD = "time [s],voltage [V]\n"


def run(path: Path) -> None:
    cases = read_cases(path)
    WORKFLOWS[cases[0].recipe.kind].run(cases, Inputs(path.parent), Execution())


def mistake(folder: Path, text: str) -> str:
    (folder / "r.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        run(folder / "r.toml")
    (line,) = caught.value.messages
    return line


WAVES = ACTUATE.replace('voltage = "4 kV"', 'voltage = "1 kV"\n[[step]]\nwaveform = "sine"\nhigh = "2 kV"\nperiod = "1 s"')


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ACTUATE.replace("1.9", "9"), "film.prestretch: 9 is beyond the Gent limit, J_lim = 55"),
        (ACTUATE.replace("1.9", "[9, 1.5]"), "film.prestretch: 9 x 1.5 is beyond the Gent limit, J_lim = 55"),
        (ACTUATE + '[sweep]\n"film.prestretch" = [1.5, 1.9, 9]\n', "case 2: film.prestretch: 9 is beyond the Gent limit"),
        (
            ACTUATE + '[sweep]\n"film.prestretch" = [1.5, 9]\n"film.relax" = ["1 s", "2 s"]\nmode = "zip"\n',
            "case 1: film.prestretch: 9 is beyond the Gent limit",
        ),
        (
            ACTUATE.replace("1.9", "190"),
            "film.prestretch: 190 is beyond the Gent limit, J_lim = 55; is it in per cent? a strain of",
        ),
        (
            ACTUATE.replace("1.9", '"190 %"'),
            'film.prestretch: "190 %": a prestretch of at least 1 is needed, or a pair such as [3.0, 1.0]; a prestretch is 1 + '
            "strain: if that is a strain, write 2.9",
        ),
        (ACTUATE.replace("1.9", "[0.9, 1]"), "film.prestretch: [0.9, 1]: a prestretch of at least 1 is needed, or a pair such"),
        ('temperature = "-250 degC"\n' + ACTUATE, "temperature: -250 degC is at or below"),
        (ACTUATE + '[sweep]\ntemperature = ["0 degC", "-250 degC"]\n', "case 1: temperature: -250 degC is at or below"),
        (ACTUATE + '[sweep]\n"step.0.rate" = ["100 V/s", "-5 V/s"]\n', "step[0]: rate -5 V/s leads away from the voltage"),
        (ACTUATE + '[output]\ntimes = ["1 h"]\n', "output.times: 3600 s lies after the end of the programme at 0 s"),
        (MAP.replace("1.8]", "9]"), "film.prestretch[1]: 9 is beyond the Gent limit, J_lim = 55"),
        (MAP.replace("[1.7, 1.8]", "9"), "film.prestretch: 9 is beyond the Gent limit, J_lim = 55"),
        (
            'temperature = ["0 degC", "9 degC"]' + MAP.replace("1.8]", "9]"),
            "film.prestretch[1]: 0 degC: 9 is beyond the Gent limit",
        ),
        ('temperature = ["20 degC", "-250 degC"]\n' + MAP, "temperature: -250 degC is at or below"),
        (RELAX + '[sweep]\n"step.0.rate" = ["1 %/s", "-5 %/s"]\n', "step[0]: rate -0.05 leads away from the target"),
        (RELAX + '[sweep]\n"step.0.stretch" = [2.0, 20.0]\n', "case 1: step[0]: stretch 20 is beyond the Gent limit"),
        (
            ACTUATE.replace('"4 kV"', '"4 kV"\nrate = "1e-300 V/s"'),
            "step[0].rate: the step takes 4e+303 s; from 1e-15 to 1e+15 s is needed",
        ),
        (ACTUATE.replace('"4 kV"', '"4 kV"\nrate = "1e300 V/s"'), "step[0].rate: the step takes 4e-297 s"),
        (WAVES.replace('"1 kV"', '"1 kV"\nrate = "0 V/s"'), "step[0]: rate 0 never reaches the voltage"),
    ],
)
def test_errors_of_a_film_name_the_key_and_the_case(text: str, message: str, tmp_path: Path) -> None:
    # what the recipe alone tells is told of it, before anything is solved
    assert mistake(tmp_path, text).removeprefix(f"{tmp_path / 'r.toml'}: ").startswith(message)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("[output]\nnoise = 0.01\n", "output.noise: only relax and creep make test data with noise"),
        (
            '[plot]\ny = "major_axis [m]"\n',
            'plot.y: "major_axis [m]" needs the size of the electrode: state film.electrode_diameter',
        ),
        (
            '[[compare]]\nfile = "r.toml"\nx = "time [s]"\ny = "minor_axis [m]"\n',
            'compare[0].y: "minor_axis [m]" needs the size of the electrode: state film.electrode_diameter',
        ),
    ],
)
def test_what_an_actuation_does_not_have_is_not_asked_of_it(keys: str, message: str, tmp_path: Path) -> None:
    assert mistake(tmp_path, ACTUATE + keys).endswith(f"r.toml: {message}")


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("", "load.csv: the file is empty"),
        (HEAD, "load.csv: no columns of numbers found"),
        (HEAD + "0,0\n1,2\n0.5,3\n", "load.csv: line 4: time 0.5 s does not come after 1 s"),
        (HEAD + "0,0\n1,2\n1,3\n", "load.csv: line 4: time 1 s does not come after 1 s"),
        (HEAD + "-1,0\n1,2\n", "load.csv: line 2: time -1 s is negative"),
        (HEAD + "0,0\n1e300,2\n", "load.csv: line 3: time 1e+300 s: at most 1e+15 s is needed"),
        (HEAD + "0,0\nsoon,2\n2,1\n", 'load.csv: line 3: column "time": "soon" is not a finite number'),
        (HEAD + "0,0\n1,high\n2,1\n", 'load.csv: line 3: column "voltage": "high" is not a finite number'),
        (HEAD + "0,0\n1,\n2,1\n", 'load.csv: line 3: column "voltage": the cell is empty'),
        (HEAD + "0,0\n1,1,5\n", "load.csv: line 3: 3 cells, but the table has 2 columns"),
        (HEAD + "\n", "load.csv: no columns of numbers found: there are no rows below the header"),
        ("time [s],tension [V]\n0,0\n1,1\n", 'step[0].columns.voltage: load.csv: no column "voltage" for voltage'),
        ("when [s],voltage [V]\n0,0\n1,1\n", 'step[0].columns.time: load.csv: no column "time" for time'),
        ("time,voltage\n0,0\n1,1\n", 'load.csv: column "time" has no unit'),
        ("time [s],voltage [kg]\n0,0\n1,1\n", 'load.csv: column "voltage" [kg]: a voltage is needed'),
    ],
)
def test_a_bad_voltage_table_is_told_by_file_and_line(table: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "load.csv").write_text(table)
    assert mistake(tmp_path, TABLE).startswith(message)


def test_a_stretch_table_that_goes_back_is_told_by_file_and_line(tmp_path: Path) -> None:
    (tmp_path / "load.csv").write_text("time [s],stretch\n0,1\n2,2\n1,1.5\n")
    text = RELAX.replace('stretch = 2.0\nrate = "1 %/s"', 'table = "load.csv"')
    assert mistake(tmp_path, text).startswith("load.csv: line 4: time 1 s does not come after 2 s")


def test_a_stretch_of_nothing_is_told_by_file_and_line(tmp_path: Path) -> None:
    (tmp_path / "load.csv").write_text("time [s],stretch\n0,1\n2,0\n")
    text = RELAX.replace('stretch = 2.0\nrate = "1 %/s"', 'table = "load.csv"')
    assert mistake(tmp_path, text) == "load.csv: line 3: stretch 0: a number above 0 is needed (1 is undeformed)"


def test_a_film_without_permittivity_is_told_what_is_missing(tmp_path: Path) -> None:
    dielectric = re.compile(r"\[dielectric\][^\[]*")
    (tmp_path / "m.toml").write_text(dielectric.sub("", read_file(resolve(tmp_path, "example:vhb4905.toml"), "vhb").decode()))
    for text in (ACTUATE, MAP):
        line = mistake(tmp_path, text.replace("example:vhb4905.toml", "m.toml"))
        assert line.endswith("which a film under voltage needs: state [dielectric] permittivity in the material file")


def test_the_file_stands_in_front(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(ACTUATE.replace("1.9", "9"))
    done = dielast("actuate", "r.toml")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "r.toml: film.prestretch: 9 is beyond the Gent limit, J_lim = 55\n"
    (tmp_path / "r.toml").write_text(TABLE)
    assert dielast("actuate", "r.toml").stderr == 'r.toml: step[0].table: "load.csv": no such file\n'
    (tmp_path / "load.csv").write_text(HEAD + "0,0\n1,2\n0.5,3\n")
    assert dielast("actuate", "r.toml").stderr.startswith("load.csv: line 4: time 0.5 s does not come after 1 s")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[1.7, 1.8]", "[1.7, 1.8, 1.7]", "film.prestretch: 1.7 is stated twice: the values of a list must differ"),
        ("[1.7, 1.8]", "[1.7, [1.7, 1.7]]", "film.prestretch: 1.7 is stated twice"),
        ("[1.7, 1.8]", "[[3, 1], 1.8, [3.0, 1.0]]", "film.prestretch: 3 x 1 is stated twice"),
        ('["3 kV"]', '["3 kV", "4 kV", "4000 V"]', "voltage.values: 4000 V after 4000 V: the voltages must ascend"),
        ('["3 kV"]', '["4 kV", "3 kV"]', "voltage.values: 3000 V after 4000 V: the voltages must ascend"),
        ("horizon", 'temperature = ["20 degC", "0 degC", "293.15 K"]\nhorizon', "temperature: 20 degC is stated twice"),
        ('["3 kV"]', '["3 kV"]\nramp = "1 min"', "voltage.ramp: 60 s is longer than the horizon of 1 s"),
        ('horizon = "1 s"', 'horizon = "1e300 h"', 'horizon: "1e300 h": a time from 1e-15 to 1e+15 s is needed'),
        ("[film]", '[film]\nrelax = "1e300 h"', 'film.relax: "1e300 h": a time from 1e-15 to 1e+15 s is needed'),
        ("[film]", '[film]\nprestretch_rate = "1e300 /s"', 'film.prestretch_rate: "1e300 /s": a strain rate from 1e-15'),
    ],
)
def test_maps_that_cannot_be_meant(old: str, new: str, message: str, tmp_path: Path) -> None:
    assert mistake(tmp_path, MAP.replace(old, new)).startswith(f"{tmp_path / 'r.toml'}: {message}")


@pytest.mark.parametrize(
    ("axis", "message"),
    [
        ('from = "1 kV"\nto = "5 kV"\npoints = 1', "voltage: points = 1 is a single voltage: from (1000 V) and to (5000 V)"),
        ('from = "5 kV"\nto = "5 kV"\npoints = 9', "voltage: from (5000 V) must be below to (5000 V)"),
        ('from = "5 kV"\nto = "1 kV"\npoints = 9', "voltage: from (5000 V) must be below to (1000 V)"),
    ],
)
def test_voltages_that_make_no_axis(axis: str, message: str, tmp_path: Path) -> None:
    line = mistake(tmp_path, MAP.replace('values = ["3 kV"]', axis))
    assert line.startswith(f"{tmp_path / 'r.toml'}: {message}")


def test_a_single_voltage_may_be_from_and_to(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(MAP)
    (tmp_path / "b.toml").write_text(MAP.replace('values = ["3 kV"]', 'from = "3 kV"\nto = "3 kV"\npoints = 1'))
    for name in "ab":
        done = dielast("failure-map", f"{name}.toml", "-q")
        assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "a/failure-map.csv").read_bytes() == (tmp_path / "b/failure-map.csv").read_bytes()
