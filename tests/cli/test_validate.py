"""`validate` opens what a recipe names and says by which key a mistake was reached; nothing runs."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]
RELAX = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n'
HOLD = '[[step]]\nhold = "1 s"\n'
COMPARE = '[[compare]]\nfile = "points.csv"\nx = "time [s]"\ny = "stretch_1 [1]"\n'


def errors(done: subprocess.CompletedProcess[str]) -> list[str]:
    assert done.returncode == 2
    assert done.stdout == ""
    return done.stderr.splitlines()


@pytest.mark.parametrize(
    ("recipe", "files", "message"),
    [
        (
            RELAX.replace("example:vhb4905.toml", "out/spectrum/material.toml") + HOLD,
            {},
            'material: "out/spectrum/material.toml" does not exist; run the recipe that makes it (dielast spectrum or dielast '
            "calibrate or dielast lifetime)",
        ),
        (RELAX.replace("example:vhb4905.toml", "vhb.toml") + HOLD, {}, 'material: "vhb.toml": no such file'),
        (
            RELAX.replace("example:vhb4905.toml", "vhb.toml") + HOLD,
            {"vhb.toml": "name = 1 +"},
            "material: vhb.toml: line 1: not TOML",
        ),
        (RELAX + '[[step]]\ntable = "h.csv"\n', {}, 'step[0].table: "h.csv": no such file'),
        (
            RELAX + HOLD + '[[step]]\ntable = "h.csv"\n',
            {"h.csv": "time [s],stretch\n1,1.1\n2,x\n"},
            'step[1].table: h.csv: line 3: column "stretch": "x" is not a finite number',
        ),
        (
            RELAX + HOLD + COMPARE,
            {"points.csv": "time [s],b\n1,2\n2,3\n"},
            'compare[0].file: points.csv: no column "stretch_1" for y',
        ),
        (
            RELAX + HOLD + COMPARE + 'where = { b = "7" }\n',
            {"points.csv": "time [s],stretch_1,b\n1,2,3\n2,3,3\n"},
            "compare[0].file: points.csv: no row has b = 7",
        ),
        (
            RELAX + HOLD + COMPARE + COMPARE + "case = 3\n",
            {"points.csv": "time [s],stretch_1\n1,2\n2,3\n"},
            "compare[1].case: 3: cases are numbered from 0, and the last is 0",
        ),
        (RELAX + 'load = "l.toml"\n', {}, 'load: "l.toml": no such file'),
        (
            'kind = "spectrum"\nmastercurve = "out/mastercurve"\n',
            {},
            'mastercurve: "out/mastercurve" does not exist; run the recipe that makes it (dielast mastercurve)',
        ),
        ('kind = "spectrum"\nmastercurve = "."\n', {}, "mastercurve: ./summary.toml: no such file"),
        (
            'kind = "spectrum"\n[data]\nfile = "c.csv"\nreference_temperature = "20 degC"\n',
            {"c.csv": "time [s],E\n1,2\n2,1\n"},
            'data.file: c.csv: no column "modulus" for modulus',
        ),
        (
            'kind = "mastercurve"\n[data]\nfile = "c.csv"\ncolumns = { temperature = "T", modulus = "E" }\n'
            '[shift]\nreference_temperature = "20 degC"\n',
            {"c.csv": "T [degC],time [s],E [Pa]\n20,1,2\n20,2,x\n"},
            'data.file: c.csv: line 3: column "E": "x" is not a finite number',
        ),
        (
            'kind = "actuate"\nmaterial = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\n[[step]]\ntable = "v.csv"\n',
            {"v.csv": "time [s],voltage\n1,1\n2,2\n"},
            'step[0].table: v.csv: column "voltage" has no unit',
        ),
        (
            'kind = "failure-map"\nmaterial = "m.toml"\nhorizon = "1 h"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\n'
            '[voltage]\nvalues = "3 kV"\n',
            {"m.toml": 'reference_temperature = "20 degC"\n'},
            "material: m.toml: equilibrium: is needed",
        ),
    ],
)
def test_a_mistake_in_a_file_is_told_with_file_and_key(
    recipe: str, files: dict[str, str], message: str, dielast: Run, tmp_path: Path
) -> None:
    (tmp_path / "r.toml").write_text(recipe)
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    before = sorted(tmp_path.iterdir())
    lines = errors(dielast("validate", "r.toml"))
    assert any(line.startswith(f"r.toml: {message}") for line in lines), lines
    assert sorted(tmp_path.iterdir()) == before


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


SPECTRUM = """
kind = "spectrum"
mastercurve = "example:mastercurve"
"""
CARDS = '[export]\nformats = ["febio"]\nhyperelastic = "neo-hookean"\n'


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            '[reduce]\nwindow = ["1 s", "1 h"]\ntemperatures = ["20 degC", "-180 degC"]\n' + CARDS,
            [
                "reduce.temperatures: -180 degC is at or below -166.879 degC, where the WLF law has its pole",
                'export.temperature: febio has no shift function for the law "wlf": state the one temperature that its',
            ],
        ),
        (
            CARDS + 'temperature = "20 degC"\n',
            [
                "export.formats: febio takes at most 6 Prony terms, the spectrum has 30: fit fewer ([fit] branches)",
            ],
        ),
        ('[reduce]\nwindow = ["1 s", "1 h"]\ntolerance = 0.05\n' + CARDS + 'temperature = "20 degC"\n', []),
        ("[truncate]\nkeep = 40\n", ["truncate.keep: cannot keep 40 of 30 branches"]),
        ('[fit]\nequilibrium_modulus = "78 MPa"\n', ["fit.equilibrium_modulus"]),
        ("[fit]\npolynomial_degree = 7\n", []),
    ],
)
def test_what_spectrum_refuses_validate_refuses_in_the_same_lines(text: str, told: list[str], dielast: Run, tmp_path: Path) -> None:
    plateau = "" if "[fit]" in text else '[fit]\nequilibrium_modulus = "78 kPa"\n'
    (tmp_path / "s.toml").write_text(SPECTRUM + plateau + text)
    checked = dielast("validate", "s.toml")
    assert checked.returncode == (2 if told else 0), checked.stderr
    if told:
        lines = checked.stderr.splitlines()
        assert len(lines) == len(told)
        assert all(line.startswith(f"s.toml: {own}") for line, own in zip(lines, told, strict=True)), lines
        assert dielast("spectrum", "s.toml", "-o", "out", "--plot", "none").stderr == checked.stderr
        assert not (tmp_path / "out").exists()
    else:
        assert checked.stdout == "s.toml: ok\n"


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
GENT = "J_lim = 110.0"
WLF = (
    "J_lim = 110.0\n[nonequilibrium]\nrelaxation_time_s = [1.0]\nshear_modulus_Pa = [1e4]\n"
    '[shift]\nlaw = "wlf"\nC1 = 13.7\nC2 = "187.1 K"'
)
ACTUATE = 'kind = "actuate"\nmaterial = "film.toml"\n{}\n[film]\nthickness = "0.5 mm"\n{}\n[[step]]\nvoltage = "1 kV"\n'
WAVES = 'waveform = "sine"\nhigh = 1.1\nperiod = "1 s"\ncycles = 3'
STRETCH = 'kind = "relax"\nmaterial = "film.toml"\n{}\n[[step]]\nstretch = {}\n{}'
MAP = (
    'kind = "failure-map"\nmaterial = "film.toml"\nhorizon = "1 h"\n{}\n[film]\nthickness = "0.5 mm"\nprestretch = [2.0, {}]\n'
    '[voltage]\nvalues = "3 kV"\n'
)
GOAL = (
    'kind = "design"\nmaterial = "film.toml"\n{}\n[film]\nthickness = "0.5 mm"\nprestretch = {}\n'
    '[goal]\nrelative_stretch = 1.2\nat = "1 h"\nhorizon = "2 h"\n'
)


@pytest.mark.parametrize(
    ("film", "recipe", "message"),
    [
        (FILM.format(GENT, EPS), MAP.format("", 9.0), r"film.prestretch\[1\]: 9 is beyond the Gent limit"),
        (FILM.format(GENT, EPS), GOAL.format("", "[2.0, 9.0]"), r"film.prestretch\[1\]: 9 is beyond the Gent limit"),
        (FILM.format(WLF, EPS), MAP.format('temperature = "-180 degC"', 3.0), "temperature: -180 degC is at or below"),
        (FILM.format(GENT, "").replace("[dielectric]", ""), GOAL.format("", 2.0), "material: .* has no permittivity"),
        (FILM.format(GENT, EPS), ACTUATE.format("", "") + '[stop]\nat = "damage"', 'stop.at: "damage" cannot happen'),
        (FILM.format(GENT, EPS), ACTUATE.format("", "") + '[stop]\nat = "breakdown"', "stop.at: material .* no breakdown field"),
        (FILM.format(GENT, "").replace("[dielectric]", ""), ACTUATE.format("", ""), "material: .* has no permittivity"),
        (
            FILM.format(GENT, 'temperature = ["0 degC", "60 degC"]\nrelative_permittivity = [4.7, 4.6]'),
            ACTUATE.format('temperature = "90 degC"', ""),
            "temperature: 90 degC is outside the permittivity table",
        ),
        (FILM.format(WLF, EPS), ACTUATE.format('temperature = "-180 degC"', ""), "temperature: -180 degC is at or below -167.1"),
        (FILM.format(WLF, EPS), STRETCH.format('temperature = "-180 degC"', 2, ""), "temperature: -180 degC is at or below"),
        (FILM.format(GENT, EPS), ACTUATE.format("", "prestretch = 9.0"), "film.prestretch: 9 is beyond the Gent limit"),
        (
            FILM.format(GENT, f"{EPS}\nstretch_coefficient = -0.4"),
            ACTUATE.format("", "prestretch = 3.0"),
            "film.prestretch: 3: the permittivity is not positive there",
        ),
        (
            FILM.format('law = "arruda-boyce"\nlocking_stretch = 4.0', EPS),
            STRETCH.format("", 9, ""),
            r"step\[0\]: stretch 9 is beyond the Arruda-Boyce limit",
        ),
        (
            FILM.format(GENT, EPS),
            STRETCH.format("", 2, '[sweep]\n"equilibrium.J_lim" = [110.0, 1.0]\n'),
            r"case 1: step\[0\]: stretch 2 is beyond the Gent limit, J_lim = 1$",
        ),
        (
            FILM.format(GENT, EPS),
            STRETCH.format("", 2, '[[step]]\nhold = "1 min"\n[output]\ntimes = ["1 s", "1 h"]\n'),
            r"output.times: 3600 s lies after the end of the history at 60 s$",
        ),
        (
            FILM.format(GENT, EPS),
            STRETCH.format("", 2, "[output]\ncycles = [1, 4]\n").replace("stretch = 2", WAVES),
            r"output.cycles: 4: the waveform has only 3 cycles$",
        ),
        (
            FILM.format(GENT, EPS),
            ACTUATE.format("", 'boundary = "frame"\nelectrode_share = 0.1\nprestretch = 1.5') + '[output]\nprofile = ["1 s"]\n',
            r"output.profile: 1 s lies after the end of the programme at 0 s$",
        ),
        (
            FILM.format(GENT, EPS),
            STRETCH.format("", 2, '[[step]]\nhold = "1 min"\n')
            + '[sweep]\n"step.1.hold" = ["1 h", "1 min"]\n[output]\ntimes = ["61 s"]\n',
            r"case 1: output.times: 61 s lies after the end of the history at 60 s$",
        ),
    ],
)
def test_what_a_simulation_refuses_validate_refuses_in_the_same_line(
    dielast: Run, tmp_path: Path, film: str, recipe: str, message: str
) -> None:
    (tmp_path / "film.toml").write_text(film)
    (tmp_path / "r.toml").write_text(recipe)
    (line,) = errors(dielast("validate", "r.toml"))
    assert re.match(f"r.toml: {message}", line)
    done = dielast(recipe.split('"')[1], "r.toml", "-o", "out", "--plot", "none")
    assert [text for text in errors(done) if not text.startswith("warning")] == [line]
    assert not (tmp_path / "out").exists()


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
