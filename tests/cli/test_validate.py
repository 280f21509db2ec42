"""`validate` opens what a recipe names and says by which key a mistake was reached; nothing runs."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from processes import Run

RELAX = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n'
HOLD = '[[step]]\nhold = "1 s"\n'
COMPARE = '[[compare]]\nfile = "points.csv"\nx = "time [s]"\ny = "stretch_1 [1]"\n'


def errors(done: subprocess.CompletedProcess[str]) -> list[str]:
    assert done.returncode == 2
    assert done.stdout == ""
    return done.stderr.splitlines()


def test_every_file_of_a_recipe_is_read_before_the_verdict(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text("name = 3\n")
    (tmp_path / "points.csv").write_text("nothing\n")
    (tmp_path / "r.toml").write_text(RELAX.replace("example:vhb4905.toml", "m.toml") + HOLD + COMPARE)
    lines = errors(dielast("validate", "r.toml"))
    assert {line.split(": ")[1] for line in lines} == {"material", "compare[0].file"}


def test_a_swept_file_is_told_once(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("name = 3\n")
    sweep = '[sweep]\nmaterial = ["example:vhb4905.toml", "bad.toml"]\ntemperature = ["0 degC", "20 degC"]\n'
    (tmp_path / "r.toml").write_text(RELAX + HOLD + sweep)
    lines = errors(dielast("validate", "r.toml"))
    assert len(lines) == len(set(lines)) == 3
    assert all(line.startswith("r.toml: material: bad.toml: ") for line in lines)


def test_load_files_are_checked_by_themselves(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text('[[step]]\nvoltage = "2 kV"\nrate = "1 kV/s"\n' + HOLD)
    assert dielast("validate", "good.toml").stdout == "good.toml: ok\n"
    (tmp_path / "bad.toml").write_text('[[step]]\nvoltage = "2 kV"\nraet = "1 kV/s"\n')
    assert errors(dielast("validate", "bad.toml")) == ['bad.toml: step[0].raet: unknown key; did you mean "rate"?']


@pytest.mark.parametrize(
    "text",
    [
        '[fit]\nequilibrium_modulus = "78 kPa"\n[reduce]\nwindow = ["1 s", "1 h"]\ntolerance = 0.05\n'
        '[export]\nformats = ["febio"]\nhyperelastic = "neo-hookean"\ntemperature = "20 degC"\n',
        "[fit]\npolynomial_degree = 7\n",
    ],
)
def test_what_spectrum_can_run_is_ok(text: str, dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('kind = "spectrum"\nmastercurve = "example:mastercurve"\n' + text)
    assert dielast("validate", "s.toml").stdout == "s.toml: ok\n"


def test_a_material_file_is_warned_of_as_in_a_run(dielast: Run, tmp_path: Path) -> None:
    film = 'reference_temperature = "{}"\n[equilibrium]\nshear_modulus = "26 kPa"\n[dielectric]\npermittivity = "{}"\n'
    (tmp_path / "film.toml").write_text(film.format("20 K", "4.5 F/m"))
    done = dielast("validate", "film.toml")
    assert (done.returncode, done.stdout) == (0, "film.toml: ok\n")
    first, second = done.stderr.splitlines()
    assert first.startswith("warning: film.toml: the reference temperature is -253.15 degC")
    assert second.startswith("warning: film.toml: the permittivity is 5.08e+11 times that of the vacuum")
    (tmp_path / "film.toml").write_text(film.format("20 degC", "4e-11 F/m"))
    assert dielast("validate", "film.toml").stderr == ""


FILM = 'reference_temperature = "20 degC"\n[equilibrium]\nshear_modulus = "26 kPa"\n{}\n[dielectric]\n{}\n'
EPS = 'permittivity = "4e-11 F/m"'
WLF = (
    "J_lim = 110.0\n[nonequilibrium]\nrelaxation_time_s = [1.0]\nshear_modulus_Pa = [1e4]\n"
    '[shift]\nlaw = "wlf"\nC1 = 13.7\nC2 = "187.1 K"'
)
ACTUATE = 'kind = "actuate"\nmaterial = "film.toml"\n{}\n[film]\nthickness = "0.5 mm"\n{}\n[[step]]\nvoltage = "1 kV"\n'
MAP = (
    'kind = "failure-map"\nmaterial = "film.toml"\nhorizon = "1 h"\n{}\n[film]\nthickness = "0.5 mm"\nprestretch = [2.0, {}]\n'
    '[voltage]\nvalues = "3 kV"\n'
)
GOAL = (
    'kind = "design"\nmaterial = "film.toml"\n{}\n[film]\nthickness = "0.5 mm"\nprestretch = {}\n'
    '[goal]\nrelative_stretch = 1.2\nat = "1 h"\nhorizon = "2 h"\n'
)


@pytest.mark.parametrize("recipe", [MAP.format("", 9.0), GOAL.format("", 2.5), ACTUATE.format("", "prestretch = 2.5")])
def test_validate_warns_as_a_run_does_before_it_solves(recipe: str, dielast: Run, tmp_path: Path) -> None:
    limit = '[breakdown]\nprestretch = [1.0, 1.5]\nfield = ["20 MV/m", "30 MV/m"]\n'
    shift = '[shift]\nlaw = "arrhenius"\nactivation_energy = "-50 kJ/mol"\n'
    branch = "[nonequilibrium]\nrelaxation_time_s = [1.0]\nshear_modulus_Pa = [1e4]\n"
    (tmp_path / "film.toml").write_text(FILM.format("J_lim = 200.0", EPS) + limit + branch + shift)
    (tmp_path / "r.toml").write_text(recipe)
    checked = dielast("validate", "r.toml")
    assert checked.stdout == "r.toml: ok\n"
    stated = [line.replace("r.toml: ", "") for line in checked.stderr.splitlines()]
    assert sum("breakdown fields are stated for 1 to 1.5" in line for line in stated) == 1
    assert sum("activation energy" in line for line in stated) == 1
    done = dielast(recipe.split('"')[1], "r.toml", "-o", "out", "--plot", "none")
    assert done.returncode == 0
    assert [line for line in done.stderr.splitlines() if line in stated] == stated


def refused(dielast: Run, folder: Path, lines: list[str]) -> None:
    """`validate` and the run refuse r.toml in these lines, and the run writes nothing."""
    kind = (folder / "r.toml").read_text().partition('kind = "')[2].partition('"')[0]
    for done in (dielast("validate", "r.toml"), dielast(kind, "r.toml", "-o", "out", "--plot", "none")):
        stated = [line for line in errors(done) if not line.startswith("warning")]
        assert len(stated) == len(lines), stated
        assert all(re.match(f"r.toml: {line}", text) for line, text in zip(lines, stated, strict=True)), stated
    assert not (folder / "out").exists()


def test_every_mistake_of_every_case_is_reported_before_anything_is_solved(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "film.toml").write_text(FILM.format(WLF, EPS))
    recipe = ACTUATE.format("", "") + '[[step]]\nhold = "1 h"\n[output]\ntimes = ["1 h"]\n[sweep]\nmode = "zip"\n'
    sweep = '"film.boundary" = ["dead-load", "clamped", "clamped", "clamped"]\n"film.prestretch" = [9.0, 10.0, 2.0, 11.0]\n'
    (tmp_path / "r.toml").write_text(recipe + sweep + 'temperature = ["20 degC", "20 degC", "-180 degC", "20 degC"]\n')
    beyond = r"case {}: film\.prestretch: {} is beyond the Gent limit"
    pole = r"case 2: temperature: -180 degC is at or below"
    refused(dielast, tmp_path, [beyond.format(0, 9), beyond.format(1, 10), pole, beyond.format(3, 11)])


WAVE = '[[step]]\nwaveform = "sine"\nhigh = {}\nperiod = "1 s"\ncycles = 3\n'


@pytest.mark.parametrize(
    ("kept", "sweep", "line"),
    [
        ("[1]", 'temperature = ["0 degC", "20 degC"]', "output.cycles: has no effect without a waveform"),
        ("[1]", 'load = ["hold.toml", "other.toml"]', "output.cycles: has no effect without a waveform"),
        ("[1, 7]", 'load = ["hold.toml", "wave.toml"]', "case 1: output.cycles: 7: the waveform has only 3 cycles"),
    ],
)
def test_cycles_of_no_waveform_are_refused_in_a_sweep(kept: str, sweep: str, line: str, dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "wave.toml").write_text(WAVE.format(2.0))
    for name in ("hold.toml", "other.toml"):
        (tmp_path / name).write_text("[[step]]\nstretch = 2.0\n" + HOLD)
    load = "" if "load" in sweep else 'load = "hold.toml"\n'
    (tmp_path / "r.toml").write_text(f"{RELAX}{load}[output]\ncycles = {kept}\n[sweep]\n{sweep}\n")
    refused(dielast, tmp_path, [line])


def test_output_after_the_end_is_refused_before_the_simulation(dielast: Run, tmp_path: Path) -> None:
    steps = '[[step]]\nstretch = 2.0\nrate = "0.1 /s"\n' + HOLD
    (tmp_path / "r.toml").write_text(RELAX + steps + '[output]\ntimes = ["12 s"]\n')
    refused(dielast, tmp_path, ["output.times: 12 s lies after the end of the history at 11 s"])
