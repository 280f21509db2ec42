from __future__ import annotations

import re
import shutil
import signal
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from maps import MAP, map_of
from processes import ENDS, SMALL_CHUNKS, Run, alive, half_done, until

from dielast.io.table import number_columns, parse_csv

ACTUATE = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "1.5 h"
[[step]]
voltage = "4 kV"
[[step]]
hold = "10 min"
[breakdown]
field = "48 MV/m"
[stop]
at = "end"
"""


def test_events_stand_in_their_table_and_in_the_summary(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(ACTUATE)
    done = dielast("actuate", "a.toml")
    assert done.returncode == 0, done.stderr
    events = parse_csv((tmp_path / "a/events.csv").read_bytes(), "events.csv")
    assert events["event"] == ["breakdown", "pull-in"]
    assert float(events["true_field [V/m]"][0]) == pytest.approx(48e6, rel=1e-6)
    # Eq. 21
    assert float(events["stretch_1 [1]"][0]) == pytest.approx((48e6 * 0.5e-3 / 4e3) ** 0.5, rel=1e-6)
    summary = tomllib.loads((tmp_path / "a/summary.toml").read_text())
    assert summary["breakdown"]["time_s"] == [float(events["time [s]"][0])]
    stability, voltage = number_columns((tmp_path / "a/actuate.csv").read_bytes(), "a", ["stability [1]", "voltage [V]"])
    assert stability[0] < 1
    assert set(voltage) == {4000.0}


def test_a_run_stops_where_it_is_told_to(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(ACTUATE)
    ends = {}
    for stop in ("breakdown", "pull-in", "end"):
        assert dielast("actuate", "a.toml", "--plot", "none", "-o", stop, "--set", f"stop.at={stop}").returncode == 0
        (times,) = number_columns((tmp_path / stop / "actuate.csv").read_bytes(), "a", ["time [s]"])
        ends[stop] = times.max()
    assert ends["breakdown"] < ends["pull-in"] < ends["end"] == 600
    for stop, name in (("breakdown", "breakdown"), ("pull-in", "pull-in")):
        events = parse_csv((tmp_path / stop / "events.csv").read_bytes(), "events.csv")
        assert events["event"][-1] == name


def test_waveforms_tables_and_steps_are_one_mechanism(dielast: Run, tmp_path: Path) -> None:
    head = ACTUATE.split("[[step]]")[0] + '[output]\ntimes = ["1 s", "3 s", "4 s", "7 s"]\n'
    steps = "".join(f'[[step]]\nvoltage = "{v} kV"\nduration = "2 s"\n' for v in (2, 0, 2, 0))
    wave = '[[step]]\nwaveform = "triangle"\nhigh = "2 kV"\nperiod = "4 s"\ncycles = 2\n'
    (tmp_path / "v.csv").write_text("time [s],voltage [kV]\n0,0\n2,2\n4,0\n6,2\n8,0\n")
    tail = "[breakdown]\nfield = '48 MV/m'\n"
    found = []
    for name, body in (("steps", steps), ("wave", wave), ("table", '[[step]]\ntable = "v.csv"\n')):
        (tmp_path / f"{name}.toml").write_text(head + body + tail)
        done = dielast("actuate", f"{name}.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr
        found.append(number_columns((tmp_path / name / "actuate.csv").read_bytes(), name, ["voltage [V]", "stretch_1 [1]"]))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-6)
    assert found[0][0].tolist() == [1000, 1000, 0, 1000]


def test_electrode_axes_in_millimetres_are_compared(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "camera.csv").write_text("time [s],major [mm]\n1,10.5\n10,11\n60,12\n")
    text = ACTUATE.replace("prestretch = 1.9", 'prestretch = 1.9\nelectrode_diameter = "10 mm"')
    text += '[[compare]]\nfile = "camera.csv"\nx = "time [s]"\ny = "major_axis [m]"\ny_column = "major"\n'
    (tmp_path / "a.toml").write_text(text)
    done = dielast("actuate", "a.toml")
    assert done.returncode == 0, done.stderr
    summary = tomllib.loads((tmp_path / "a/summary.toml").read_text())
    assert 0 < summary["compare"]["rms_error"] < 0.01
    assert "major_axis" not in (tmp_path / "a/actuate.csv").read_text()


def test_an_interrupted_map_goes_on_where_it_stopped(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(map_of(30))
    assert dielast("failure-map", "m.toml", "--plot", "none", "-o", "whole").returncode == 0
    store = tmp_path / "part/.unfinished"
    with half_done(tmp_path, "part") as process:
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=ENDS)
    assert process.returncode == 130
    assert re.fullmatch(r"interrupted: \d+ of 180 cells are kept: the same command goes on from there, .*anew\n", said)
    kept = store.stat().st_size
    assert kept > 1000
    # another recipe says that it has no use for it
    other = dielast("failure-map", "m.toml", "--plot", "none", "-o", "part", "--set", "horizon=1 s", "--set", "voltage.ramp=2 s")
    assert (other.returncode, store.stat().st_size) == (2, kept)
    copy = shutil.copytree(tmp_path / "part", tmp_path / "other")
    other = dielast("failure-map", "m.toml", "--plot", "none", "-o", copy, "--set", "voltage.points=2")
    assert re.search(
        r"^note: the \d+ cells of an interrupted run are discarded: the recipe, .* has changed since$", other.stderr, re.M
    )
    again = dielast("failure-map", "m.toml", "--plot", "none", "-o", "part", prelude=SMALL_CHUNKS)
    assert again.returncode == 0
    assert re.match(r"note: goes on from an interrupted run, which kept \d+ of 180 cells\n", again.stderr)
    assert not store.exists()
    for name in ("failure-map.csv", "fit.csv", "summary.toml"):
        assert (tmp_path / "part" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.trust
def test_a_terminated_map_leaves_no_process_behind(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(map_of(125, "1 h"))
    with half_done(tmp_path, "out", "--jobs", "2") as process:
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=ENDS)
        assert process.returncode == 143
        assert re.fullmatch(r"interrupted: \d+ of 750 cells are kept: the same command .*\n", said)
        until(lambda: not alive(process.pid))


def test_a_film_broken_at_once_fails_at_0_s(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(ACTUATE.replace("4 kV", "9 kV"))
    done = dielast("actuate", "a.toml", "--set", "stop.at=breakdown")
    assert done.returncode == 0, done.stderr
    events = parse_csv((tmp_path / "a/events.csv").read_bytes(), "events.csv")
    assert (events["event"], events["time [s]"]) == (["breakdown"], ["0"])


def test_what_is_no_whole_earlier_run_is_passed_over(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(MAP)
    np.save(tmp_path / "array.npy", np.zeros(3))
    for content in (b"", b"PK", (tmp_path / "array.npy").read_bytes()):
        (tmp_path / "m").mkdir(exist_ok=True)
        (tmp_path / "m/.unfinished").write_bytes(content)
        done = dielast("failure-map", "m.toml", "--plot", "none", "-q")
        assert (done.returncode, done.stderr) == (0, "")
        assert not (tmp_path / "m/.unfinished").exists()


@pytest.mark.parametrize(("kind", "prestretch"), [("actuate", 5), ("failure-map", 1.4)])
def test_the_starters_take_any_prestretch(kind: str, prestretch: float, starter: Callable[[str], Path], dielast: Run) -> None:
    path = starter(kind)
    few = ["--set", "voltage.points=3"] if kind == "failure-map" else []
    done = dielast(kind, path, "-o", "out", "--plot", "none", "-q", "--set", f"film.prestretch={prestretch}", *few)
    assert done.returncode == 0, done.stderr
    nearest = "40 MV/m" if prestretch < 1.7 else "48 MV/m"
    told = f"prestretch {prestretch}: breakdown fields are stated for 1.7 to 1.9: the nearest, {nearest}, is taken; to state one"
    assert (told in done.stderr) == (kind == "failure-map")  # the other starter states one field for all
    assert (path.parent / "out" / f"{kind}.csv").is_file()


@pytest.mark.parametrize(("x", "y"), [("time [s]", "stretch_1 [1]"), ("stretch_1 [1]", "thickness_stretch [1]")])
def test_a_film_that_fails_before_the_first_output_has_its_figure(dielast: Run, tmp_path: Path, x: str, y: str) -> None:
    text = ACTUATE.replace("4 kV", "9 kV").replace('"end"', '"breakdown"')
    (tmp_path / "a.toml").write_text(f'{text}[output]\ntimes = ["9 s"]\n[plot]\nx = "{x}"\ny = "{y}"\n')
    done = dielast("actuate", "a.toml", "-q")
    assert (done.returncode, "cannot be drawn" in done.stderr) == (0, False)
    assert (tmp_path / "a/actuate.png").is_file()
