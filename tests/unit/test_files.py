from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from processes import ENDS

from dielast.errors import InputError
from dielast.io import files
from dielast.io.files import Inputs, depfile, write_files


def test_inputs_remember_what_was_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"abc")
    inputs = Inputs(tmp_path)
    assert inputs.read("a.csv") == b"abc"
    assert inputs.digests == (("a.csv", hashlib.sha256(b"abc").hexdigest()),)
    assert inputs.paths == (tmp_path / "a.csv",)


def test_inputs_of_one_name_in_two_folders_are_two(tmp_path: Path) -> None:
    inputs = Inputs(tmp_path)
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "m.csv").write_text(name)
        inputs.read(tmp_path / name / "m.csv")
    inputs.read(tmp_path / "b" / "m.csv")
    assert inputs.digests == tuple(("m.csv", hashlib.sha256(name).hexdigest()) for name in (b"a", b"b"))


def test_missing_inputs_and_folders_are_input_errors(tmp_path: Path) -> None:
    inputs = Inputs(tmp_path)
    with pytest.raises(InputError, match=r"b.csv: no such file"):
        inputs.read("b.csv")
    with pytest.raises(InputError, match="is a folder, a file is needed"):
        inputs.read(".")
    with pytest.raises(InputError, match="no such example; there are example:"):
        inputs.read("example:nothing")
    with pytest.raises(InputError, match="no such example"):
        inputs.read("example:../__init__.py")


def test_files_are_replaced_whole_and_with_ordinary_rights(tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    write_files(out, {"a.csv": b"old"})
    write_files(out, {"a.csv": b"new", "b.csv": b"b"})
    assert {path.name: path.read_bytes() for path in out.iterdir()} == {"a.csv": b"new", "b.csv": b"b"}
    mask = os.umask(0)
    os.umask(mask)
    assert (out / "a.csv").stat().st_mode & 0o777 == 0o666 & ~mask


def test_a_failed_write_leaves_the_old_result(tmp_path: Path) -> None:
    write_files(tmp_path, {"a.csv": b"old"})
    with pytest.raises(InputError, match="cannot write here"):
        write_files(tmp_path, {"a.csv": b"new", "missing/b.csv": b"b"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"a.csv": b"old"}


def test_what_a_killed_run_left_is_swept(tmp_path: Path) -> None:
    dead, alive = tmp_path / ".a.csv.4194304.part", tmp_path / f".a.csv.{os.getppid()}.part"
    for path in (dead, alive):
        path.write_bytes(b"half")
    write_files(tmp_path, {"a.csv": b"new"})
    assert not dead.exists()
    assert alive.exists()


def test_a_depfile_quotes_for_make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = depfile([tmp_path / "out" / "a.csv"], [tmp_path / "my data.csv", tmp_path / "r$.toml"])
    assert text == "out/a.csv: my\\ data.csv \\\n  r$$.toml\n\nmy\\ data.csv:\n\nr$$.toml:\n"


def test_a_file_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dielast.io.files.LARGEST", 3 << 20)
    with pytest.raises(InputError, match=r"^/dev/zero: larger than 3 MiB"):
        Inputs(tmp_path).read("/dev/zero")


@pytest.mark.parametrize("name", ["a" * 5000, "example:" + "a/" * 3000, "nul\x00.csv"])
def test_a_name_that_no_file_can_have_is_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError) as caught:
        Inputs(tmp_path).read(name)
    (line,) = caught.value.messages
    assert line.isprintable()
    assert len(line) < 1001


def test_of_two_runs_into_one_folder_all_files_are_the_later_ones(tmp_path: Path) -> None:
    names = [f"{number}.csv" for number in range(40)]
    write = (
        "import sys; from pathlib import Path; from dielast.io.files import write_files\n"
        "for _ in range(30): write_files(Path(sys.argv[1]), {name: sys.argv[2].encode() * 999 for name in sys.argv[3:]})"
    )
    runs = [subprocess.Popen([sys.executable, "-c", write, str(tmp_path / "out"), mark, *names]) for mark in "ab"]
    assert [run.wait(ENDS) for run in runs] == [0, 0]
    assert len({(tmp_path / "out" / name).read_bytes() for name in names}) == 1
    assert len(list((tmp_path / "out").iterdir())) == len(names)


def test_a_lock_that_nobody_gives_back_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")
    monkeypatch.setattr(files, "LONGEST_WAIT", 0.05)
    handle = os.open(tmp_path, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        write_files(tmp_path, {"a.csv": b"1\n"})
        assert (tmp_path / "a.csv").read_bytes() == b"1\n"
    finally:
        os.close(handle)
