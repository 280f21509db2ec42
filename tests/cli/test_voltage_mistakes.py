"""What is wrong with a film or with a table of load is told by file, key, case and line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from processes import Run

from dielast.base.errors import InputError
from dielast.commands.actuate import run as actuate
from dielast.commands.grids import failure_map
from dielast.commands.membrane import run as relax
from dielast.commands.registry import read_cases
from dielast.io.files import Inputs, read_file, resolve
from dielast.sharing.execution import Execution

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


def run(path: Path) -> None:
    cases = read_cases(path)
    WORKFLOWS[cases[0].recipe.kind].run(cases, Inputs(path.parent), Execution())


def mistake(folder: Path, text: str) -> str:
    (folder / "r.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        run(folder / "r.toml")
    (line,) = caught.value.messages
    return line


def test_a_film_without_permittivity_is_told_what_is_missing(tmp_path: Path) -> None:
    dielectric = re.compile(r"\[dielectric\][^\[]*")
    (tmp_path / "m.toml").write_text(dielectric.sub("", read_file(resolve(tmp_path, "example:vhb4905.toml"), "vhb").decode()))
    for text in (ACTUATE, MAP):
        line = mistake(tmp_path, text.replace("example:vhb4905.toml", "m.toml"))
        assert line.endswith("which a film under voltage needs: state [dielectric] permittivity in the material file")


def test_a_single_voltage_may_be_from_and_to(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(MAP)
    (tmp_path / "b.toml").write_text(MAP.replace('values = ["3 kV"]', 'from = "3 kV"\nto = "3 kV"\npoints = 1'))
    for name in "ab":
        done = dielast("failure-map", f"{name}.toml", "-q")
        assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "a/failure-map.csv").read_bytes() == (tmp_path / "b/failure-map.csv").read_bytes()
