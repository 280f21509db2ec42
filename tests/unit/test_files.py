from __future__ import annotations

import errno
import hashlib
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from processes import ENDS

from dielast.base.errors import InputError
from dielast.commands.simulation.result import CaseColumns
from dielast.io import files, spool
from dielast.io.files import Inputs, check_targets, depfile, write_files
from dielast.io.spool import Spooled

LEFT = f".dielast-{'0a' * 16}.part"


def test_inputs_of_one_name_in_two_folders_are_two(tmp_path: Path) -> None:
    inputs = Inputs(tmp_path)
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "m.csv").write_text(name)
        inputs.read(tmp_path / name / "m.csv")
    inputs.read(tmp_path / "b" / "m.csv")
    assert inputs.digests == [("m.csv", hashlib.sha256(name).hexdigest()) for name in (b"a", b"b")]


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


def test_what_a_killed_run_left_is_swept_by_who_is_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    left = tmp_path / LEFT
    left.write_bytes(b"half")
    with files.alone_in(tmp_path) as alone:
        assert alone
        monkeypatch.setattr(files, "LONGEST_WAIT", 0.05)  # a lock that nobody gives back is not waited for
        write_files(tmp_path, {"a.csv": b"new"})
    assert (left.read_bytes(), (tmp_path / "a.csv").read_bytes()) == (b"half", b"new")
    write_files(tmp_path, {"a.csv": b"newer"})
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_what_is_not_a_runs_own_is_neither_swept_nor_written_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder that others may write into."""
    precious = tmp_path / "precious"
    precious.write_bytes(b"precious")
    out = tmp_path / "out"
    out.mkdir()
    (out / ".x.123.part").write_bytes(b"mine")
    (out / LEFT).symlink_to(precious)
    (out / "a.csv").symlink_to(precious)
    monkeypatch.setattr(files.secrets, "token_hex", lambda count: "0a" * count)  # as if the name could be foretold
    with pytest.raises(InputError, match="out: cannot write here: file exists"):
        write_files(out, {"a.csv": b"new"})
    monkeypatch.undo()
    write_files(out, {"a.csv": b"new"})
    assert precious.read_bytes() == b"precious"
    assert (out / "a.csv").read_bytes() == b"new"
    assert not (out / "a.csv").is_symlink()
    assert (out / ".x.123.part").read_bytes() == b"mine"


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_waits_until_all_files_are_moved(name: str, tmp_path: Path) -> None:
    if not hasattr(signal, name):
        pytest.skip("not a signal of this system")
    number, came, states = getattr(signal, name), [], []
    before = signal.signal(number, lambda *_: came.append(sorted(path.name for path in tmp_path.iterdir())))

    def moved(whole: bool) -> None:
        states.append(whole)
        signal.raise_signal(number)
        assert len(came) == whole  # a second one acts at once

    try:
        write_files(tmp_path, {"a.csv": b"a", "b.csv": b"b"}, moved)
        assert states == [False, True]
        assert came == [["a.csv", "b.csv"]] * 2
    finally:
        signal.signal(number, before)


def test_a_pipe_without_a_writer_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe: is a named pipe, a file is needed"):
        Inputs(tmp_path).read("pipe")
    reading, writing = os.pipe()  # that of a shell: <(...)
    os.write(writing, b"1,2")
    os.close(writing)
    assert Inputs(tmp_path).read(f"/dev/fd/{reading}") == b"1,2"
    os.close(reading)


def test_without_locks_of_folders_nothing_is_swept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fcntl", None)  # type: ignore[arg-type]
    (tmp_path / LEFT).write_bytes(b"half")
    write_files(tmp_path, {"a.csv": b"new"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"a.csv": b"new", LEFT: b"half"}


def test_a_target_that_a_program_keeps_open_leaves_all_as_they_were(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, where what a spreadsheet has open can be neither moved nor replaced."""
    write_files(tmp_path, {"a.csv": b"old", "b.csv": b"old"})
    replace, attempts = os.replace, []

    def refuse(source: Path, target: Path) -> None:
        if target.name == "b.csv" and len(attempts) < held:
            attempts.append(source)
            raise PermissionError(13, "Access is denied")
        replace(source, target)

    monkeypatch.setattr(os, "replace", refuse)
    monkeypatch.setattr(files, "PAUSES", (0.0, 0.0, 0.0))
    held = 1000
    with pytest.raises(InputError, match=r"b\.csv: cannot be replaced: permission denied; close the program that has it open"):
        write_files(tmp_path, {"a.csv": b"new", "b.csv": b"new"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"a.csv": b"old", "b.csv": b"old"}
    held, attempts[:] = 2, []  # such as by a virus scanner
    write_files(tmp_path, {"a.csv": b"new", "b.csv": b"new"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"a.csv": b"new", "b.csv": b"new"}


def test_an_input_is_not_written_over_under_another_spelling(tmp_path: Path) -> None:
    data, same = tmp_path / "data.csv", tmp_path / "DATA.csv"
    data.write_bytes(b"1")
    if not same.exists():
        os.link(data, same)  # one file under two names, as where file systems do not tell their case
    with pytest.raises(InputError, match="is an input of this run"):
        check_targets([same], [data])
    other = tmp_path / "other.csv"
    os.link(data, other)  # but a link may be replaced: the input stays
    check_targets([other], [data])


def test_a_depfile_quotes_for_make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = depfile([Path("out/a.csv")], [tmp_path / "my data.csv", tmp_path / "r$.toml"])
    assert text == "out/a.csv: my\\ data.csv \\\n  r$$.toml\n\nmy\\ data.csv:\n\nr$$.toml:\n"


@pytest.mark.parametrize("name", ["a\nb:;date", "a\tb", "a;date", "a|b", "50 %", "T=20", "a\\ b", "a\\", "R&"])
def test_what_make_cannot_hold_is_refused_by_name(name: str) -> None:
    with pytest.raises(InputError, match="make cannot hold") as caught:
        depfile([Path("a.csv")], [Path(name)])
    assert str(caught.value).startswith(name.encode("unicode_escape").decode() if "\n" in name or "\t" in name else name)


def test_a_depfile_names_a_target_as_the_makefile_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("dielast.io.files._make_name", str)
    assert depfile([tmp_path / "out" / "a.csv"], [Path("r.toml")]).startswith(f"out/a.csv {tmp_path}/out/a.csv: r.toml")
    beside = tmp_path.parent / "a.csv"
    assert depfile([beside], [beside]).startswith(f"{beside}: {beside}\n")


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
        "for _ in range(10): write_files(Path(sys.argv[1]), {name: sys.argv[2].encode() * 999 for name in sys.argv[3:]})"
    )
    runs = [subprocess.Popen([sys.executable, "-c", write, str(tmp_path / "out"), mark, *names]) for mark in "ab"]
    assert [run.wait(ENDS) for run in runs] == [0, 0]
    assert len({(tmp_path / "out" / name).read_bytes() for name in names}) == 1
    assert len(list((tmp_path / "out").iterdir())) == len(names)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("data\test.csv", r"; a backslash in double quotes begins an escape"),
        (r"data\messung.csv", r"; write / between folders: it does on every system"),
        ("data/messung.csv", r""),
    ],
)
def test_a_path_with_backslashes_says_what_to_write(tmp_path: Path, name: str, hint: str) -> None:
    if os.sep != "/":
        pytest.skip("a system that takes backslashes")
    with pytest.raises(InputError) as caught:
        Inputs(tmp_path).read(name)
    assert f"no such file{hint}" in str(caught.value)
    assert bool(hint) == (";" in str(caught.value))


@pytest.mark.parametrize("folder", [True, False])
def test_no_room_for_a_temporary_file_is_one_line(folder: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a folder of temporary files that is full, and without any that can be used."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path) if folder else None)
    if folder:
        full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    else:
        full = FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp', '/var/tmp']")

    def fails(*_: object) -> None:
        raise full

    monkeypatch.setattr(tempfile, "TemporaryFile", fails)
    monkeypatch.setattr(tempfile, "gettempdir", fails)
    with pytest.raises(InputError) as caught:
        Spooled([b"long"])
    reason = (
        f"{tmp_path}: cannot write a temporary file: no space left on device"
        if folder
        else "cannot write a temporary file: no usable folder"
    )
    assert str(caught.value) == f"{reason}; set TMPDIR to a folder with room"


def test_devices_of_windows_are_no_folders() -> None:
    names = ("con", "Aux.d", "NUL .x", "com1", "lpt9.csv", "console", "com10", "fig9", "x.nul")
    assert [name for name in names if files.names_a_device(name)] == ["con", "Aux.d", "NUL .x", "com1", "lpt9.csv"]


def test_arrays_beyond_a_limit_lie_in_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spool, "IN_MEMORY", 100)
    tables = [np.arange(number, number + 6.0).reshape(2, 3) for number in range(4)]
    holder = spool.Spool()
    places = [holder.put(table) for table in tables]
    assert [isinstance(place, np.ndarray) for place in places] == [True, True, False, False]
    cases = [CaseColumns(("x [m]", "y [Pa]"), place) for place in places]
    for table, case in zip(tables * 2, [*cases, *pickle.loads(pickle.dumps(cases))], strict=True):
        assert np.array_equal([case["x [m]"], case["y [Pa]"]], table)
    assert isinstance(pickle.loads(pickle.dumps(cases[-1])).numbers, np.ndarray)
    assert holder.put(np.empty((2, 0)))[1].size == 0  # a case without rows
