"""`dielast measure`: files of photographs, their times, what is lost, and a run that goes on."""

from __future__ import annotations

import io
import os
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from photographs import Scene, render, saved
from PIL import Image
from processes import Run

from dielast.io.table import parse_csv

SCENE = Scene((96, 90), (47.0, 44.5), (50.0, 50.0), noise=0.02)
FRAMES = [render(replace(SCENE, axes=(50.0 + 2 * k, 50.0 + k), seed=k)) for k in range(3)]
RECIPE = 'kind = "measure"\nfiles = "photo-*"\ninterval = "8 s"\n'
HEADER = (
    "file,time [s],centre_x [px],centre_y [px],major_axis [px],minor_axis [px],angle [deg],relative_stretch_1 [1],"
    "relative_stretch_1_stderr [1],relative_stretch_2 [1],relative_stretch_2_stderr [1],area_strain [1],state"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for number, frame in enumerate(FRAMES):
        (tmp_path / f"photo-{number + 8}.png").write_bytes(saved(frame))  # 8, 9, 10: sorted as numbers
    (tmp_path / "r.toml").write_text(RECIPE)
    return tmp_path


def table(path: Path) -> dict[str, list[str]]:
    return parse_csv(path.read_bytes(), path.name)


def test_a_series_is_measured_and_the_result_is_the_same_again(dielast: Run, folder: Path) -> None:
    done = dielast("measure", "r.toml", "-o", "out", "--depfile", "r.d")
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in (folder / "out").iterdir()} == {"electrode.csv", "measure.png", "photographs.png", "summary.toml"}
    assert (folder / "out/electrode.csv").read_text().splitlines()[0] == HEADER
    rows = table(folder / "out/electrode.csv")
    assert rows["file"] == ["photo-8.png", "photo-9.png", "photo-10.png"]
    assert rows["time [s]"] == ["0", "8", "16"]
    assert [float(cell) for cell in rows["relative_stretch_1 [1]"]] == pytest.approx([1, 1.04, 1.08], rel=2e-3)
    assert [float(cell) for cell in rows["relative_stretch_2 [1]"]] == pytest.approx([1, 1.02, 1.04], rel=2e-3)
    assert "photo-10.png" in (folder / "r.d").read_text()
    assert len(tomllib.loads((folder / "out/summary.toml").read_text())["inputs"]) == 4
    again = dielast("measure", "r.toml", "-o", "again", "--golden", "out", "--jobs", "2", "-q", "--plot", "none")
    assert (again.returncode, again.stderr) == (0, "")
    assert (folder / "again/electrode.csv").read_bytes() == (folder / "out/electrode.csv").read_bytes()


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ('times="t.csv"', ["1", "2", "4"]),
        ('times="photo-{min}.png"', ["480", "540", "600"]),
        ('times="exif"', ["0", "30", "61.5"]),
    ],
)
def test_times_from_a_table_names_and_exif(dielast: Run, folder: Path, setting: str, expected: list[str]) -> None:
    (folder / "t.csv").write_text("file,time [ms]\nphoto-9.png,2000\nphoto-8.png,1000\nphoto-10.png,4000\n")
    for number, moment, fraction in ((8, "07:08:09", "0"), (9, "07:08:39", "0"), (10, "07:09:10", "5")):
        exif = Image.Exif()
        exif[0x0112] = 1
        exif.get_ifd(0x8769)[0x9003], exif.get_ifd(0x8769)[0x9291] = f"2024:05:06 {moment}", fraction
        Image.fromarray(np.round(FRAMES[number - 8] * 255).astype(np.uint8)).save(folder / f"photo-{number}.png", exif=exif)
    (folder / "r.toml").write_text(RECIPE.replace('interval = "8 s"', setting))
    done = dielast("measure", "r.toml", "-o", "out", "-q", "--plot", "none")
    assert (done.returncode, done.stderr) == (0, "")
    assert table(folder / "out/electrode.csv")["time [s]"] == expected


def test_a_stack_a_folder_and_a_scale(dielast: Run, folder: Path) -> None:
    frames = [Image.fromarray(np.round(frame * 65535).astype(np.uint16)) for frame in FRAMES]
    (folder / "stacks").mkdir()
    frames[0].save(folder / "stacks/a.tif", save_all=True, append_images=frames[1:])
    (folder / "stacks/notes.txt").write_text("not a photograph")
    electrode = '[electrode]\ndiameter = "10 mm"\nmark = [[10, 10], [10, 50]]\nmark_length = "8 mm"\n'
    (folder / "r.toml").write_text(RECIPE.replace("photo-*", "stacks") + electrode)
    done = dielast("measure", "r.toml", "-o", "out", "-q", "--plot", "none")
    assert (done.returncode, done.stderr) == (0, "")
    rows = table(folder / "out/electrode.csv")
    assert rows["file"] == ["stacks/a.tif#0", "stacks/a.tif#1", "stacks/a.tif#2"]
    assert [float(cell) for cell in rows["relative_stretch_1 [1]"]] == pytest.approx([1, 1.04, 1.08], rel=2e-3)


def test_damaged_and_empty_photographs_are_lost_and_the_run_goes_on(dielast: Run, folder: Path) -> None:
    jpeg = saved(FRAMES[0], "jpg")
    for number, content in enumerate(
        (jpeg[: len(jpeg) // 2], b"%PDF-1.4\n", saved(np.full((90, 96), 0.8)), saved(np.ones((1, 1))))
    ):
        (folder / f"photo-1{number + 1}.png").write_bytes(content)
    (folder / "photo-20.png").write_bytes(saved(FRAMES[2]))
    done = dielast("measure", "r.toml", "-o", "out", "-q", "--plot", "none")
    assert done.returncode == 0
    lines = done.stderr.splitlines()
    assert [line.split(": ")[1:3] for line in lines] == [[f"photo-1{number}.png", "lost"] for number in range(1, 5)]
    assert "cut off" in lines[0]
    assert "no picture" in lines[1]
    rows = table(folder / "out/electrode.csv")
    assert rows["state"] == ["ok"] * 3 + ["lost"] * 4 + ["ok"]
    assert rows["relative_stretch_1 [1]"][3:7] == [""] * 4
    # and a simulation is compared with the others
    film = '[film]\nthickness = "1 mm"\nprestretch = 2.0\n[[step]]\nvoltage = "100 V"\nduration = "60 s"\n'
    compare = '[[compare]]\nfile = "out/electrode.csv"\nx = "time [s]"\ny = "relative_stretch_1 [1]"\n'
    (folder / "f.toml").write_text('kind = "actuate"\nmaterial = "example:vhb4905.toml"\n' + film + compare)
    compared = dielast("actuate", "f.toml", "-o", "f", "--plot", "none")
    assert "compare.points = 4\n" in compared.stdout


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"interval": ""}, 'times are needed: either interval, such as "8 s", or times'),
        ({'8 s"': '8 s"\ntimes = "exif"'}, "interval: interval and times are both stated: leave one out"),
        ({"photo-*": "nothing-*"}, 'files: "nothing-*": no file matches'),
        ({"8 s": "8"}, "interval: "),
        (
            {"RECIPE": '[electrode]\ndiameter = "10 mm"\n'},
            "electrode.diameter: one of scale, mark and camera.length is needed with it",
        ),
        ({"RECIPE": "[electrode]\naxis_1 = 3\n"}, 'electrode.axis_1: 3: an angle with its unit is needed, such as "30 deg"'),
        (
            {"RECIPE": "[electrode]\nregion = [200, 0, 230, 30]\n"},
            "photo-8.png: the reference: the region holds only 0 x 30",
        ),
        ({"RECIPE": "[electrode]\ndark = false\n"}, "photo-8.png: the reference: no electrode is found"),
        (
            {"RECIPE": "[camera]\nsquare = [[0, 0], [9, 9], [9, 0], [0, 9]]\n"},
            "camera: the corners of a square are needed, in order",
        ),
        ({'interval = "8 s"': 'times = "photo-{s}.jpg"'}, "photo-8.png: times: the name does not fit"),
        ({'interval = "8 s"': 'times = "exif"'}, "photo-8.png: EXIF does not say when it was taken; "),
        ({'interval = "8 s"': 'times = "none.csv"'}, "none.csv: times: no such file"),
    ],
)
def test_a_mistake_is_one_line(dielast: Run, folder: Path, changes: dict[str, str], message: str) -> None:
    text = RECIPE
    for old, new in changes.items():
        text = text + new if old == "RECIPE" else text.replace(f'{old} = "8 s"\n' if old == "interval" else old, new)
    (folder / "r.toml").write_text(text)
    done = dielast("measure", "r.toml", "-o", "out", "-q")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert message in done.stderr
    assert not (folder / "out").exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_pipes_and_links_into_nowhere_are_no_photographs(dielast: Run, folder: Path) -> None:
    os.mkfifo(folder / "pipe.png")
    (folder / "loop.png").symlink_to(folder / "loop.png")
    for name in ("pipe.png", "loop.png", "/dev/zero"):
        (folder / "r.toml").write_text(RECIPE.replace('"photo-*"', f'["{name}"]'))
        done = dielast("measure", "r.toml", "-o", "out", "-q")
        assert done.returncode == 2
        assert len(done.stderr.splitlines()) == 1
        assert name in done.stderr


def test_an_interrupted_run_goes_on(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from dielast.commands.measure import photographs as module
    from dielast.commands.measure.photographs import PhotographPlan, measure_all
    from dielast.sharing import study
    from dielast.sharing.execution import Execution

    names = tuple((f"photo-{number}.png", 0) for number in (8, 9, 10))
    plan = PhotographPlan(folder, names, True, None, None, "mean", False)
    monkeypatch.setattr(module, "CHUNK", 1)
    monkeypatch.setattr(study, "PAUSE", 0.0)

    def stop(done: int, of: int, what: str) -> None:
        if done == 2:
            raise KeyboardInterrupt

    (folder / "out").mkdir()
    with pytest.raises(KeyboardInterrupt):
        measure_all(plan, study.Study(Execution(folder=folder / "out", progress=stop), "key"))
    notes: list[str] = []
    (folder / "photo-9.png").write_bytes(saved(FRAMES[0]))  # changed since: measured anew
    result = measure_all(plan, study.Study(Execution(folder=folder / "out", note=notes.append), "key"))
    assert notes == ["goes on from an interrupted run, which kept 1 of 3 photographs"]
    anew = measure_all(plan, study.Study())
    for kept, fresh in zip(result, anew, strict=True):
        assert kept.outline.flat.shape.tolist() == fresh.outline.flat.shape.tolist()
        assert kept.outline.flat.covariance.tolist() == fresh.outline.flat.covariance.tolist()
        assert (kept.outline.inside, kept.outline.holes, kept.digest) == (fresh.outline.inside, fresh.outline.holes, fresh.digest)
        assert np.array_equal(kept.thumbnail, fresh.thumbnail)


def test_colour_is_read_where_electrode_and_film_differ(dielast: Run, folder: Path) -> None:
    random = np.random.default_rng(3)
    for number, frame in enumerate(FRAMES):
        levels = np.round(frame * 255).astype(np.uint8)
        buffer = io.BytesIO()
        # the electrode is blue's alone, and the mean has the noise of red
        noise = random.integers(0, 256, levels.shape, dtype=np.uint8)
        Image.fromarray(np.stack([noise, np.full_like(levels, 128), levels], axis=-1)).save(buffer, "png")
        (folder / f"photo-{number + 8}.png").write_bytes(buffer.getvalue())
    done = dielast("measure", "r.toml", "-o", "out", "--plot", "none")
    assert "photographs.ok = 3\n" in done.stdout
    assert "photographs.colour = blue\n" in done.stdout
