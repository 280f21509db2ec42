"""`dielast calibrate`: what is wrong is said, what cannot be followed is named, and its material goes into the next command."""

from __future__ import annotations

import re
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from machines import QUIET, Machine, cycles, hold, softened
from processes import Run

from dielast import Gent, Material, MeasuredTest, NoShift, Spectrum, VoltageTest, read_draws, read_material
from dielast.calibration.laboratory import Laboratory
from dielast.commands.calibrate.task import prepared
from dielast.commands.plan import warnings_of
from dielast.commands.registry import read_cases
from dielast.io.files import Inputs
from dielast.io.table import parse_csv
from dielast.simulate.film_setup import Film

SPECIMEN = 'specimen = { gauge_length = "80 mm", width = "22 mm", thickness = "1 mm" }'
TEST = f'[[test]]\nfile = "example:tensile/hold.csv"\n{SPECIMEN}\n'
FREE = '[free]\n"equilibrium.shear_modulus" = {}\n'
HEAD = 'kind = "calibrate"\nmaterial = "example:tensile/start.toml"\n'
QUICK = "[fit]\nstarts = 1\n[uncertainty]\ndraws = 0\n"


PREDICTED = '[prediction]\nfilm = { thickness = "1 mm", prestretch = 2.0, boundary = ["dead-load", "clamped"] }\n'
PREDICTED += "relative_stretch = 1.1\n"


def test_validate_reads_each_file_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(HEAD + TEST + TEST.replace("hold", "fast") + 'temperature = "30 degC"\n' + FREE)
    names, read = list[str](), Inputs.read
    monkeypatch.setattr(Inputs, "read", lambda self, name: (names.append(str(name)), read(self, name))[1])
    assert warnings_of(tmp_path / "r.toml") == []
    assert sorted(names) == [f"example:tensile/{name}" for name in ("fast.csv", "hold.csv", "start.toml")]


def test_rows_of_one_time_and_stretch_are_one_with_their_mean_stress(tmp_path: Path) -> None:
    rows = ["0,1,0", *(f"{k},{1 + 0.1 * k},{1e4 * k}" for k in range(1, 9))]
    head = "time [s],stretch,nominal_stress [Pa]"
    (tmp_path / "once.csv").write_text("\n".join([head, *rows]))
    (tmp_path / "again.csv").write_text("\n".join([head, *rows[:5], "5,1.5,4e4", "5,1.5,5e4", "5,1.5,6e4", *rows[6:]]))
    read = []
    for name in ("once", "again"):
        (tmp_path / f"{name}.toml").write_text(HEAD + f'[[test]]\nfile = "{name}.csv"\n' + FREE)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            read += prepared(read_cases(tmp_path / f"{name}.toml"), Inputs(tmp_path)).tests
    once, again = read
    assert np.array_equal([once.time, once.stretch, once.stress], [again.time, again.stretch, again.stress])
    line = "again.csv: line 8 repeats time and stretch of the row before, 5 s; so do 1 more: mean stresses are taken"
    assert any(line in str(each.message) for each in caught)


def test_a_fit_needs_more_points_than_parameters(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "few.csv").write_text("time [s],stretch,nominal_stress [Pa]\n1,1.1,3e3\n2,1.2,4e3\n3,1.3,5e3\n")
    free = '[free]\n"equilibrium.shear_modulus" = {}\n"equilibrium.J_lim" = {}\n"nonequilibrium.scale" = {}\n'
    (tmp_path / "r.toml").write_text(HEAD + '[[test]]\nfile = "few.csv"\n' + free)
    done = dielast("calibrate", "r.toml")
    assert (done.returncode, done.stderr.startswith("r.toml: test: 3 measured points for 3 free parameters: ")) == (2, True)


def test_a_test_that_cannot_be_followed_is_named_and_the_others_are_kept(dielast: Run, tmp_path: Path) -> None:
    fast = TEST.replace("hold", "fast")  # up to a stretch of 4
    material = 'name = "short"\nreference_temperature = "20 degC"\n[equilibrium]\nshear_modulus = "20 kPa"\nJ_lim = 8\n'
    material += '[nonequilibrium]\nrelaxation_time_s = [50.0]\nshear_modulus_Pa = [2e4]\n[shift]\nlaw = "none"\n'
    (tmp_path / "short.toml").write_text(material)
    (tmp_path / "r.toml").write_text(HEAD.replace("example:tensile/start.toml", "short.toml") + TEST + fast + FREE + QUICK)
    done = dielast("calibrate", "r.toml", "--plot", "none")
    assert done.returncode == 3
    assert "r.toml: test fast: left out, the material cannot follow it" in done.stderr
    assert parse_csv((tmp_path / "r/tests.csv").read_bytes(), "tests")["test"] == ["hold"]
    electric = TEST.replace("[[test]]", '[[test]]\nvoltage = "6 kV"')
    (tmp_path / "r.toml").write_text(HEAD.replace("example:tensile/start.toml", "short.toml") + electric + FREE + QUICK)
    done = dielast("calibrate", "r.toml", "--plot", "none")
    assert done.returncode == 2
    assert "short.toml: test hold is under voltage: state [dielectric] permittivity" in done.stderr
    (tmp_path / "short.toml").write_text(material + "[dielectric]\nrelative_permittivity = 4.5\n[breakdown]\nfield = '45 MV/m'\n")
    (tmp_path / "r.toml").write_text((tmp_path / "r.toml").read_text().replace("6 kV", "6000 kV"))
    (warned,) = warnings_of(tmp_path / "r.toml")
    assert "makes a field of 6e+09 V/m, 133 times the breakdown field: is the voltage, or the thickness" in warned
    (tmp_path / "film.csv").write_text("voltage [V],stretch\n2.2,2.016\n5,2.1\n8,2.41\n")
    film = '[[test]]\nfile = "film.csv"\nfilm = { thickness = "1 mm", prestretch = 2.0 }\nramp = "1 V/s"\n'
    (tmp_path / "r.toml").write_text(HEAD + TEST + film + FREE)
    (warned,) = warnings_of(tmp_path / "r.toml")
    # 3.98e-11 F/m (8 V/1 mm)^2 2.41^4
    assert "test film: at 8 V the electrostatic stress is 0.086 Pa, " in warned
    assert warned.endswith("is the voltage, or film.thickness, in a wrong unit?")


def test_a_stretch_for_a_strain_and_kelvin_for_celsius_are_warned_of(tmp_path: Path) -> None:
    (tmp_path / "pull.csv").write_text("time [s],e [1],stress [kPa]\n0,1,0.1\n1,1.5,20\n2,2,33\n")
    slipped = '[[test]]\nfile = "pull.csv"\ncolumns = { strain = "e" }\ntemperature = "293 degC"\n'
    (tmp_path / "r.toml").write_text(HEAD + TEST + slipped + FREE)
    strain, kelvin = warnings_of(tmp_path / "r.toml")
    assert "the first point has a stretch of 2, but next to no stress: " in strain
    assert "tests are at 293 degC: was the value in kelvin" in kelvin


def test_what_does_not_fit_to_the_rest_to_the_times_and_to_other_tests_is_warned_of(tmp_path: Path) -> None:
    stretch = np.linspace(1, 2, 21)
    taut = np.maximum(stretch - 0.1, 1)
    rows = [f"{at:.3g},{1 + at:.6g},{value:.6g}\n" for at, value in zip(stretch - 1, 30 * (taut - taut**-2), strict=True)]
    (tmp_path / "loose.csv").write_text("time [s],stretch,stress [kPa]\n" + "".join(rows))
    loose = '[[test]]\nfile = "loose.csv"\n'
    material = '[nonequilibrium]\nrelaxation_time_s = [50.0]\nshear_modulus_Pa = [2e4]\n[shift]\nlaw = "none"\n'
    (tmp_path / "m.toml").write_text('reference_temperature = "20 degC"\n[equilibrium]\nshear_modulus = "2e4 Pa"\n' + material)
    head = 'kind = "calibrate"\nmaterial = "m.toml"\n'
    more = TEST + 'temperature = "60 degC"\n' + loose.replace("test", "validate")
    (tmp_path / "r.toml").write_text(head + loose + 'rate = "1 %/s"\n' + loose + more + FREE)
    rated, *late, cold, copy = warnings_of(tmp_path / "r.toml")
    assert "loose.csv: rate states the times in place of the column time" in rated
    for key, said in zip(("test[0]", "test[1]", "validate[0]"), late, strict=True):
        assert said.startswith(f"{key}: loose.csv: the specimen is slack up to a stretch of 1.100 at least")
    assert "at 60 degC it relaxes as at 20 degC: state [shift]" in cold
    assert copy == "test loose under [[validate]] has the points of test loose (2): it validates nothing"


def test_what_curves_show_besides_their_material_is_named_and_left_out(dielast: Run, tmp_path: Path) -> None:
    """Ringing, a time that is stated to be left out, softening, slack, and a history that is not told."""
    truth = Material("t", 22e3, Spectrum([300.0, 8.0], [16e3, 35e3]), NoShift(20.0), Gent(110.0), Gent(55.0))
    ringing = hold(truth, Machine(force=0.5, noise=0.003), np.random.default_rng(2), rate=10.0)
    again = softened(cycles(truth, Machine(force=0.0, overshoot=0.0), np.random.default_rng(2), points=20), 0.2)
    loop = cycles(truth, replace(QUIET, noise=0.003), np.random.default_rng(2), count=1)
    for name, made in (("ring", ringing), ("again", again), ("loop", loop)):
        (tmp_path / f"{name}.csv").write_text(made.table())
    (tmp_path / "late.csv").write_text("time [s],stretch,stress [kPa]\n900,2,40\n1800,2,36\n36000,2,33\n")
    stated = 'ignore = "none"\ndiscard_before = "0.75 s"\ndiscard = [["4.05 s", "5.05 s"], ["1e6 s", "2e6 s"]]\n'
    tests = [("ring", ""), ("ring", stated), ("again", 'slack = "pushes"\n'), ("loop", ""), ("loop", 'slack = "pushes"\n')]
    recipe = HEAD + "".join(f'[[test]]\nfile = "{name}.csv"\n{SPECIMEN}\n{more}' for name, more in tests)
    late = '[[validate]]\nfile = "late.csv"\nmode = "pure-shear"\n'
    (tmp_path / "r.toml").write_text(recipe + late + FREE + QUICK)
    done = dielast("calibrate", "r.toml", "--plot", "none", "-q")
    assert done.returncode == 0, done.stderr
    for said in (
        r"ring\.csv: (\d+) of 140 points are left out of the misfit, at 0\.\d+ to .* s, 4\.1 to .* s: a force that swings",
        r"ring\.csv: discard\[1\]: there is no point from 1e\+06 to 2e\+06 s",
        r"again\.csv: later loadings are softer than the first by 1\d % .*\(Mullins\).*discard",
        r"late\.csv: the first point is at 900 s and a stretch of 2: it is reached by a ramp from time 0",
        r"test late lasts 3\.6e\+04 s",
        r"test late is in pure-shear loading, the fitted tests in uniaxial loading only: the springs are ex",
    ):
        assert re.search(said, done.stderr), (said, done.stderr)
    tests = parse_csv((tmp_path / "r/tests.csv").read_bytes(), "tests")
    found, asked, *_ = (int(count) for count in tests["left_out_points [1]"])
    assert 10 < found < 50  # two transients at 10 Hz, each of 2.1 s until it has faded into noise
    assert asked == 8 + 10
    assert [int(points) + count for points, count in zip(tests["points"], (found, asked), strict=False)] == [140, 140]
    said = r"specimens go slack when they are unloaded, and bear nothing: loop.* up to a stretch of 1\.\d+ \((\d+) of 121 points\)"
    named = re.search(said, done.stderr)
    assert named, done.stderr
    assert [int(count) for count in tests["slack_points [1]"]] == [0, 0, 0, int(named[1]), 0, 0]
    assert int(named[1]) > 5
    loose, pushed = (float(error) for error in tests["rms_relative_error [1]"][3:5])
    assert loose < pushed
    (tmp_path / "r.toml").write_text(recipe + late + 'ramp_rate = "10 %/s"\n' + FREE)
    assert not any("straight line" in warned for warned in warnings_of(tmp_path / "r.toml"))


def test_a_fit_that_determines_nothing_exits_3_with_what_to_do(dielast: Run, tmp_path: Path) -> None:
    free = '[free]\n"equilibrium.J_lim" = { min = 1e3, max = 1e5 }\n'
    (tmp_path / "r.toml").write_text(HEAD + TEST + free + QUICK)
    done = dielast("calibrate", "r.toml", "--plot", "none", "-q")
    assert done.returncode == 3, done.stderr
    assert "these tests determine no free constant: free fewer of them, state priors" in done.stderr
    assert (tmp_path / "r/material.toml").exists()


def test_points_over_voltage_and_over_a_stretch_are_those_over_time(dielast: Run, tmp_path: Path) -> None:
    film = 'kind = "actuate"\nmaterial = "m.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 2.0\nrelax = "10 min"\n'
    film += '[[step]]\nvoltage = "2 kV"\nrate = "50 V/s"\n[output]\ntimes = ["5 s", "10 s", "15 s", "20 s", "30 s"]\n'
    material = 'name = "m"\nreference_temperature = "35 degC"\n[equilibrium]\nshear_modulus = "26 kPa"\n'
    material += '[nonequilibrium]\nrelaxation_time_s = [20.0]\nshear_modulus_Pa = [2e4]\n[shift]\nlaw = "none"\n'
    (tmp_path / "m.toml").write_text(material + '[dielectric]\npermittivity = "4e-11 F/m"\n')
    (tmp_path / "film.toml").write_text(film)
    assert dielast("actuate", "film.toml", "--plot", "none", "-q").returncode == 0
    stretch, volt = "relative_stretch_1 [1]", "voltage [V]"
    for x, y in (("time [s]", stretch), (volt, stretch), (stretch, volt)):
        film += f'[[compare]]\nfile = "film/actuate.csv"\nx = "{x}"\ny = "{y}"\n'
    (tmp_path / "f.toml").write_text(film)
    (tmp_path / "r.toml").write_text('kind = "calibrate"\nmaterial = "m.toml"\n[[test]]\nrecipe = "f.toml"\n' + FREE)
    task = prepared(read_cases(tmp_path / "r.toml"), Inputs(tmp_path))
    (truth,) = task.materials.values()
    answers = Laboratory(task.tests).answers([truth, replace(truth, permittivity=4.4e-11)])
    assert [test.temperature for test in task.tests] == [35.0] * 3  # the recipe states none: the reference temperature
    for test, (own, softer) in zip(task.tests, answers, strict=True):
        assert test.time == pytest.approx([5, 10, 15, 20, 30], rel=1e-4)
        assert own == pytest.approx(test.measured, rel=1e-3)  # of changes from rest; the solver's tolerance is of whole stretches
        # a tenth more permittivity: a tenth more strain, or a twentieth less voltage for it, at small voltages
        assert softer[0] / own[0] - 1 == pytest.approx(1 / 1.1**0.5 - 1 if test.unit == "V" else 0.1, rel=0.03)


@pytest.mark.parametrize(("at", "lacks"), [("profiles_of", "intervals and draws"), ("draw", "draws")])
def test_an_interrupt_keeps_the_best_so_far_and_exits_130(dielast: Run, tmp_path: Path, at: str, lacks: str) -> None:
    press = f"""
import dielast.calibration.result as module
def press(*_, **__):
    raise KeyboardInterrupt
module.{at} = press
"""
    (tmp_path / "r.toml").write_text(HEAD + TEST + FREE + QUICK.replace("draws = 0", "draws = 20"))
    done = dielast("calibrate", "r.toml", "--plot", "none", prelude=press)
    assert done.returncode == 130
    assert f"r.toml: interrupted: the best fit so far is written, without {lacks}\n" in done.stderr
    assert tomllib.loads((tmp_path / "r/summary.toml").read_text())["interrupted"] is True
    assert read_material(tmp_path / "r/material.toml").equilibrium_modulus > 0


def test_an_interrupt_among_laws_ends_the_run_without_intervals(dielast: Run, tmp_path: Path) -> None:
    press = """
import dielast.commands.calibrate.run as module
fit, done = module.fit_material, []
def press(*given, **options):
    if done:
        raise KeyboardInterrupt
    done.append(1)
    return fit(*given, **options)
module.fit_material = press
"""
    laws = '[springs]\ntry = ["gent", "neo-hookean"]\n'
    (tmp_path / "r.toml").write_text(HEAD + TEST + FREE + QUICK.replace("draws = 0", "draws = 20") + laws)
    done = dielast("calibrate", "r.toml", "--plot", "none", prelude=press)
    assert done.returncode == 130
    lacks = "intervals, draws, cross-validation and the laws not yet fitted"
    assert f"r.toml: interrupted: the best fit so far is written, without {lacks}\n" in done.stderr
    assert (tmp_path / "r/material.toml").exists()


def test_an_interrupt_between_fit_and_files_does_not_claim_that_a_fit_is_written(dielast: Run, tmp_path: Path) -> None:
    press = """
import dielast.commands.calibrate.run as module
def press(*_):
    raise KeyboardInterrupt
module.warn_of_fit = press
"""
    (tmp_path / "r.toml").write_text(HEAD + TEST + FREE + QUICK)
    done = dielast("calibrate", "r.toml", "--plot", "none", prelude=press)
    assert done.returncode == 130
    assert done.stderr == "interrupted: nothing is kept or written; the same command begins anew\n"
    assert not (tmp_path / "r").exists()


def test_a_parameter_at_a_bound_is_named_with_its_bound(dielast: Run, tmp_path: Path) -> None:
    free = '[free]\n"equilibrium.shear_modulus" = { min = "40 kPa", max = "60 kPa" }\n"nonequilibrium.shear_modulus" = {}\n'
    free += '"nonequilibrium.relaxation_time[1]" = { start = "0.01 s" }\n'
    (tmp_path / "r.toml").write_text(HEAD + TEST + TEST.replace("hold", "fast") + free + QUICK)
    done = dielast("calibrate", "r.toml", "--plot", "none", "-q")
    assert done.returncode == 0, done.stderr
    lines = done.stderr.splitlines()
    stated = "warning: equilibrium.shear_modulus is at its lower bound of 4e+04 Pa (the stated min)"
    default = "warning: nonequilibrium.relaxation_time[1] is at its upper bound of "
    assert any(line.startswith(stated) for line in lines), done.stderr
    (said,) = (line for line in lines if line.startswith(default))
    assert " s (by default half-way to relaxation_time[0] in log time: state max or start)" in said
    found = parse_csv((tmp_path / "r/parameters.csv").read_bytes(), "parameters")
    row = list(found["parameter"]).index("nonequilibrium.relaxation_time[1]")
    assert float(found["start"][row]) == 0.01
    # the bound of the search is no measured value
    assert [value == "" for value in found["value"]] == [verdict != "determined" for verdict in found["verdict"]]
    assert (found["value"][row], found["verdict"][row]) == ("", "lower bound")
    known = f"at least {float(found['lower'][row]):.4g} s at 90 %"
    origin = read_material(tmp_path / "r/material.toml").origin
    assert origin["nonequilibrium.relaxation_time[1]"] == f"fitted: not determined, {known}, by hold, fast"


def test_a_film_that_runs_away_is_warned_of(dielast: Run, tmp_path: Path) -> None:
    """The data are of the material, so that the fitted modulus, and with it the stretch, depends on no weighting of the points."""
    stretch = np.linspace(1.05, 3.0, 40)
    gent = 110 / (113 - stretch**2 - 2 / stretch)
    rows = [
        f"{10 * (each - 1):g},{each:g},{2e4 * stiffer * (each - each**-2):g}" for each, stiffer in zip(stretch, gent, strict=True)
    ]
    # as wide as long, A = stretch^2 of both axes: A^3 (1 - r A) = 1 with r = eps E^2/(mu gent)
    square = np.linspace(2.0, 5.0, 30001)
    r = 4e-11 * (6e3 / 0.5e-3) ** 2 / (2e4 * 110 / (113 - 2 * square - square**-2))
    as_wide = np.sqrt(square[square**3 * (1 - r * square) > 1][-1])
    stable = stretch[stretch < as_wide]
    (tmp_path / "pull.csv").write_text("\n".join(["time [s],stretch,stress [Pa]", *rows]))
    material = 'name = "m"\nreference_temperature = "20 degC"\n[equilibrium]\nshear_modulus = "20 kPa"\nJ_lim = 110\n'
    material += '[nonequilibrium]\nrelaxation_time_s = [1.0]\nshear_modulus_Pa = [1.0]\n[shift]\nlaw = "none"\n'
    (tmp_path / "m.toml").write_text(material + '[dielectric]\npermittivity = "4e-11 F/m"\n')
    high = '[[validate]]\nfile = "pull.csv"\nlabel = "high"\nvoltage = "6 kV"\nspecimen = { thickness = "0.5 mm" }\n'
    recipe = HEAD.replace("example:tensile/start.toml", "m.toml") + '[[test]]\nfile = "pull.csv"\n' + high + FREE + QUICK
    (tmp_path / "r.toml").write_text(recipe)
    done = dielast("calibrate", "r.toml", "-q")
    assert done.returncode == 0, done.stderr
    beyond = f"beyond a stretch of {stable[-1]:.4g}: it pulls in and becomes wider"
    assert f"warning: the material is not stable in test high {beyond}" in done.stderr
    # from there on, the model has no stress, and the errors are those of the points before
    points = parse_csv((tmp_path / "r/residuals.csv").read_bytes(), "residuals")
    high = np.flatnonzero(np.array(points["test"]) == "high")
    model, lower, measured = (
        np.array([float(cell or "nan") for cell in points[name]])[high] for name in ("model", "lower", "measured")
    )
    assert np.array_equal(np.isfinite(model), stretch < as_wide)
    assert np.array_equal(np.isfinite(lower), stretch < as_wide)
    miss = (model - measured)[stretch < as_wide]
    tests = parse_csv((tmp_path / "r/tests.csv").read_bytes(), "tests")
    assert float(tests["rms_error"][1]) == pytest.approx(np.sqrt(np.mean(np.square(miss))), rel=1e-6)


def test_laws_are_ranked(dielast: Run, tmp_path: Path) -> None:
    yeoh = 'name = "y"\nreference_temperature = "20 degC"\n[equilibrium]\nlaw = "yeoh"\nshear_modulus = "20 kPa"\nC20 = "-50 Pa"\n'
    yeoh += '[nonequilibrium]\nrelaxation_time_s = [200.0, 5.0]\nshear_modulus_Pa = [2e4, 2e4]\n[shift]\nlaw = "none"\n'
    yeoh += '[dielectric]\npermittivity = "4e-11 F/m"\n'
    (tmp_path / "yeoh.toml").write_text(yeoh)
    (tmp_path / "gent.toml").write_text(yeoh.replace('law = "yeoh"\n', "").replace('C20 = "-50 Pa"', "J_lim = 90"))
    head = 'kind = "calibrate"\nmaterials = ["gent.toml", "yeoh.toml"]\n'
    free = FREE + '"equilibrium.J_lim" = { min = 15, max = 1e4 }\n"equilibrium.C20" = {}\n"nonequilibrium.shear_modulus" = {}\n'
    tests = "".join(TEST.replace("hold", name) for name in ("hold", "fast"))
    (tmp_path / "r.toml").write_text(head + tests + free + QUICK)
    done = dielast("calibrate", "r.toml", "--plot", "none", "-q")
    assert done.returncode == 0, done.stderr
    laws = parse_csv((tmp_path / "r/laws.csv").read_bytes(), "laws")
    assert set(laws["material"]) == {"gent.toml", "yeoh.toml"}
    errors = [float(error) for error in laws["cross_validation_error [1]"]]
    assert errors == sorted(errors)
    fitted = tomllib.loads((tmp_path / "r/summary.toml").read_text())["fit"]["law"]
    assert read_material(tmp_path / "r/material.toml").equilibrium_law.name == fitted == laws["equilibrium_law"][0]


@pytest.mark.trust
def test_recipes_are_tests_and_the_material_knows_how_far_they_went(dielast: Run, tmp_path: Path) -> None:
    head = 'material = "example:tensile/start.toml"\n'
    compare = '[[compare]]\nfile = "{}/{}.csv"\nx = "time [s]"\ny = "{} [1]"\n'
    made = "[output]\npoints_per_decade = 3\n"
    film = f'kind = "actuate"\n{head}[film]\nthickness = "0.5 mm"\nprestretch = 3.0\nrelax = "5 min"\n'
    film += '[[step]]\nvoltage = "1 kV"\nduration = "1 s"\n[[step]]\nhold = "10 s"\n'
    pulled = f'kind = "creep"\n{head}[[step]]\nstress = "20 kPa"\nduration = "1 s"\n[[step]]\nhold = "2 min"\n'
    for name, kind, recipe, column in (("film", "actuate", film, "relative_stretch_1"), ("pulled", "creep", pulled, "stretch_1")):
        (tmp_path / f"{name}.toml").write_text(recipe + made)
        assert dielast(kind, f"{name}.toml", "--plot", "none", "-q").returncode == 0
        (tmp_path / f"{name}.toml").write_text(recipe + made + compare.format(name, kind, column))
    free = FREE + '"dielectric.permittivity" = { start = "6e-11 F/m" }\n"shift.C1" = { prior = 13.7, relative = "5 %" }\n'
    tests = '[[test]]\nrecipe = "film.toml"\n[[test]]\nrecipe = "pulled.toml"\n'
    (tmp_path / "r.toml").write_text(HEAD + tests + free + QUICK)
    done = dielast("calibrate", "r.toml", "-q", "--plot", "svg")
    assert done.returncode == 0, done.stderr
    assert re.search(r"shift\.C1 \(at 90 % .*\) is not determined by these tests: draws follow the prior", done.stderr)
    known = read_material(tmp_path / "r/material.toml").calibrated
    assert known is not None
    assert known.modes == ("equibiaxial", "uniaxial")
    assert 18 < known.largest_invariant < 22
    assert known.time[1] == pytest.approx(121)
    found = parse_csv((tmp_path / "r/parameters.csv").read_bytes(), "parameters")
    row = list(found["parameter"]).index("dielectric.permittivity")
    assert float(found["value"][row]) == pytest.approx(3.98e-11, rel=0.01)  # with which the points were made
    # relative errors are over the changes of the measured values from rest, here from a stretch of 1
    points = parse_csv((tmp_path / "r/residuals.csv").read_bytes(), "residuals")
    measured, model = (np.array(points[name], dtype=float) for name in ("measured", "model"))
    tests = parse_csv((tmp_path / "r/tests.csv").read_bytes(), "tests")
    assert measured.min() > 0.999
    for name, stated in zip(tests["test"], tests["rms_relative_error [1]"], strict=True):
        rows = np.array(points["test"]) == name
        missed, changed = (np.sqrt(np.mean(np.square(away[rows]))) for away in (model - measured, measured - 1))
        # both columns are written with nine digits
        assert float(stated) == pytest.approx(missed / changed, rel=1e-6, abs=2 * 5e-9 / changed)


def test_voltage_tests_are_fitted_and_laws_that_fit_alike_are_drawn_together(dielast: Run, tmp_path: Path) -> None:
    truth = Material("m", 2e4, Spectrum([20.0], [3e4]), NoShift(20.0), Gent(60.0), Gent(60.0), permittivity=4e-11)
    tests = ""
    for number, top in enumerate((2.0, 4.0)):
        at = np.linspace(0, 15 * (top - 1), 25)[1:]
        blank = MeasuredTest("pull", at, np.interp(at, [0, 10 * (top - 1), 20 * (top - 1)], [1, top, 1]), np.ones(at.size), 20.0)
        clean = Laboratory([blank]).answers([truth])[0][0]
        stress = clean * (1 + 0.05 * np.sin(9 * blank.place + 2 * number))
        rows = [f"{t:.6g},{x:.6g},{s:.6g}" for t, x, s in zip(at, blank.stretch, stress, strict=True)]
        (tmp_path / f"pull{number}.csv").write_text("\n".join(["time [s],stretch,stress [Pa]", *rows]))
        tests += f'[[test]]\nfile = "pull{number}.csv"\n'
    stretch = np.array([1.01, 1.03, 1.06, 1.1, 1.15, 1.2])
    film = Film(1e-3, 2.0, relax=600.0, boundary="frame", electrode_share=0.25)
    blank = VoltageTest("film", np.full(6, 1e4), stretch, film, 200.0, 20.0, measure="relative_stretch")
    volts = Laboratory([blank]).answers([truth])[0][0]
    rows = [f"{v / 1e3:.6g},{2 * x:.6g}" for v, x in zip(volts, stretch, strict=True)]
    (tmp_path / "film.csv").write_text("\n".join(["V [kV],stretch", "0,2", *rows]))
    held = 'film = { thickness = "1 mm", prestretch = 2.0, relax = "10 min", boundary = "frame", electrode_share = 0.25 }\n'
    held += 'ramp = ["20 V/s", "2 kV/s"]\n'
    tests += f'[[validate]]\nfile = "film.csv"\ncolumns = {{ voltage = "V" }}\n{held}'.replace('["20 V/s", "2 kV/s"]', '"200 V/s"')
    start = 'name = "m"\nreference_temperature = "20 degC"\n[equilibrium]\nshear_modulus = "20 kPa"\nJ_lim = 90\n[nonequilibrium]\n'
    start += (
        'relaxation_time_s = [30.0]\nshear_modulus_Pa = [2e4]\n[shift]\nlaw = "none"\n[dielectric]\npermittivity = "4e-11 F/m"\n'
    )
    (tmp_path / "m.toml").write_text(start)
    free = FREE + '"nonequilibrium.shear_modulus" = {}\n"nonequilibrium.relaxation_time" = {}\n'
    tried = '[springs]\ntry = [["gent", "gent"], ["ogden", "ogden"]]\n'
    few = "[fit]\nstarts = 1\n[uncertainty]\ndraws = 20\n"
    recipe = 'kind = "calibrate"\nmaterial = "m.toml"\n' + tests + free + PREDICTED + tried + few
    (tmp_path / "r.toml").write_text(recipe)
    done = dielast("calibrate", "r.toml", "-q", "--plot", "none")
    assert done.returncode == 0, done.stderr
    found = parse_csv((tmp_path / "r/tests.csv").read_bytes(), "tests")
    row = found["test"].index("film")
    assert float(found["rms_voltage_error [1]"][row]) < 0.1
    assert found["rms_voltage_error [1]"][0] in ("", "nan")
    laws = parse_csv((tmp_path / "r/laws.csv").read_bytes(), "laws")
    assert sum(map(float, laws["weight [1]"])) == pytest.approx(1.0)
    assert "these tests cannot tell gent + gent" in done.stderr
    assert "apart; the voltage of a film differs by a factor of" in done.stderr
    proposed = parse_csv((tmp_path / "r/next_tests.csv").read_bytes(), "next")
    assert not proposed["test"][0].startswith("uniaxial")
    # the voltage of the film of [prediction], of the first law
    drawn = parse_csv((tmp_path / "r/laws.csv").read_bytes(), "laws")["film_voltage [V]"]
    asked = VoltageTest(
        "asked",
        np.full(3, 1e4),
        np.array([1.02, 1.05, 1.1]),
        Film(1e-3, 2.0, boundary=("dead-load", "clamped")),
        100.0,
        20.0,
        measure="relative_stretch",
    )
    first = Laboratory([asked]).answers([read_material(tmp_path / "r/material.toml")])[0][0, -1]
    assert float(drawn[0]) == pytest.approx(first, rel=1e-3)
    draws = read_draws(tmp_path / "r/material.toml")
    assert {draw.equilibrium_law.name for draw in draws} >= {"gent", "ogden"}
    assert len(draws) == 20
    assert read_material(tmp_path / "r/material.toml").calibrated.law_spread > 1
    # the draws of both laws go on to a simulation, which says how far they differ
    drive = 'kind = "actuate"\nmaterial = "r/material.toml"\n[film]\nthickness = "1 mm"\nprestretch = 2.0\n'
    drive += '[[step]]\nvoltage = "2 kV"\n[[step]]\nhold = "1 s"\n[stop]\nat = "end"\n'
    drive += '[output]\ntimes = ["1 s"]\n[uncertainty]\ndraws = 20\n'
    (tmp_path / "a.toml").write_text(drive)
    done = dielast("actuate", "a.toml", "-q", "--plot", "none")
    assert done.returncode == 0, done.stderr
    assert "laws that fit these tests alike differ by a factor of" in done.stderr
    # a film that no draw can follow
    far = PREDICTED.replace("prestretch = 2.0", "prestretch = 40.0") + QUICK
    (tmp_path / "far.toml").write_text('kind = "calibrate"\nmaterial = "m.toml"\n[[test]]\nfile = "pull0.csv"\n' + FREE + far)
    done = dielast("calibrate", "far.toml", "-q", "--plot", "none")
    assert done.returncode == 0, done.stderr
    assert "prediction: no next_tests.csv is written, it takes at least 10 draws that can follow this film" in done.stderr
    assert not (tmp_path / "far/next_tests.csv").exists()
