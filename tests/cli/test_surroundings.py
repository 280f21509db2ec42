"""What a run finds around it: streams that are closed or full, no home, another program's settings, odd names, locked folders."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from processes import ENDS, Run

CODE = "from dielast.cli import main; main()"
RECIPE = 'kind = "relax"\nmaterial = "example:vhb4905.toml"\n[[step]]\nstretch = 1.1\nrate = "0.1 /s"\n'
WARNED = RECIPE + '[[compare]]\nfile = "m.csv"\nx = "time [s]"\ny = "stretch_1 [1]"\n'
# the superuser of Linux gives up what it may do beyond others; both words of each set of capabilities become zero
ORDINARY = """
import ctypes, os
if os.geteuid() == 0:
    libc, third_version = ctypes.CDLL(None, use_errno=True), 0x20080522
    header, none = (ctypes.c_uint32 * 2)(third_version, 0), (ctypes.c_uint32 * 6)()
    if libc.capset(header, none) != 0:
        raise OSError(ctypes.get_errno(), "capset")
"""
needs_full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")


def shell(folder: Path, streams: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line with its streams redirected as a shell does."""
    command = ["sh", "-c", f'"$@" {streams}', "sh", sys.executable, "-c", CODE, *arguments]
    own = {**os.environ, **environment}
    return subprocess.run(command, cwd=folder, env=own, capture_output=True, text=True, timeout=ENDS, check=False)


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    path = tmp_path / "r.toml"
    path.write_text(RECIPE)
    return path


@pytest.mark.parametrize(("streams", "arguments"), [(">&-", "new relax"), ("2>&-", "new relax"), ("<&- >&- 2>&-", "relax r.toml")])
@pytest.mark.usefixtures("recipe")
def test_closed_streams_change_no_exit_code(streams: str, arguments: str, tmp_path: Path) -> None:
    runs = arguments.startswith("relax")
    done = shell(tmp_path, streams, *arguments.split(), *(["--plot", "none"] if runs else []))
    assert (done.returncode, done.stderr) == (0, "")
    assert bool(done.stdout) == (streams == "2>&-")
    assert (tmp_path / "r/relax.csv").exists() == runs


def test_without_standard_error_warnings_do_not_spoil_the_json(tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(WARNED)
    (tmp_path / "m.csv").write_text("time [s],stretch_1\n0.5,1.05\n20,1\n")
    done = shell(tmp_path, "2>&-", "relax", "r.toml", "--plot", "none", "--json")
    assert done.returncode == 0
    assert json.loads(done.stdout)["warnings"]


@needs_full
@pytest.mark.parametrize("arguments", [["--version"], ["relax", "--help"], ["schema"]])
def test_a_full_output_is_one_line(arguments: list[str], dielast: Run) -> None:
    with open("/dev/full", "wb") as full:
        done = dielast(*arguments, to=full.fileno())
    assert (done.returncode, done.stderr) == (2, "cannot write: no space left on device\n")


@needs_full
def test_errors_that_nobody_hears_keep_their_exit_code(dielast: Run) -> None:
    with open("/dev/full", "wb") as full:
        assert dielast("relax", "nothere.toml", errors_to=full.fileno()).returncode == 2
        assert dielast("nothing", errors_to=full.fileno()).returncode == 2


def test_errors_to_a_reader_that_has_gone_keep_their_exit_code(dielast: Run) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = dielast("relax", "nothere.toml", to=writer, errors_to=writer)
    os.close(writer)
    assert done.returncode == 2


@pytest.mark.trust
@pytest.mark.usefixtures("recipe")
def test_plots_need_no_home_and_no_display(tmp_path: Path) -> None:
    nowhere = dict.fromkeys(("HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"), "/proc/nowhere")
    done = shell(tmp_path, "", "relax", "r.toml", "-q", MPLBACKEND="module://nowhere", MPLCONFIGDIR="/proc/nowhere", **nowhere)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (tmp_path / "r/relax.png").read_bytes().startswith(b"\x89PNG")


def test_a_name_that_is_no_utf_8_is_written_with_escapes(dielast: Run, tmp_path: Path) -> None:
    name = os.fsdecode(b"b\xff.toml")
    try:
        (tmp_path / name).write_text(RECIPE)
    except OSError:
        pytest.skip("a file system that knows text only")
    done = dielast("relax", name, "--plot", "none", "--depfile", "d")
    assert (done.returncode, done.stderr) == (0, "")
    assert 'recipe = "b\\\\udcff.toml"\n' in (tmp_path / os.fsdecode(b"b\xff") / "summary.toml").read_text()
    assert b"b\xff/relax.csv" in (tmp_path / "d").read_bytes()


@pytest.mark.usefixtures("recipe")
def test_where_nothing_can_be_written_is_said_before_anything_is_computed(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "taken/.unfinished").mkdir(parents=True)
    for arguments, said in (
        (["-o", "loop"], "loop: leads nowhere, a folder for the results is needed (see --out)"),
        (["-o", "loop/x"], "loop: leads nowhere, a folder for the results is needed (see --out)"),
        (["-o", "taken"], "taken/.unfinished: is a folder, a file is to be written there"),
        (["--depfile", "taken"], "taken: is a folder, a file is to be written there"),
        (["--depfile", "r.toml/d"], "r.toml: is a file, a folder is needed (see --depfile)"),
    ):
        done = dielast("relax", "r.toml", *arguments)
        assert (done.returncode, done.stderr) == (2, f"{said}\n")
    assert not (tmp_path / "r").exists()
    assert [path.name for path in (tmp_path / "taken").iterdir()] == [".unfinished"]


@pytest.mark.parametrize("option", ["-o", "--depfile", "--golden"])
def test_an_empty_name_is_none(option: str, dielast: Run, recipe: Path, tmp_path: Path) -> None:
    done = dielast("relax", recipe, option, "")
    assert done.returncode == 2
    assert "is empty, a name is needed" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["r.toml"]


def test_a_dependency_file_may_replace_a_loop_of_links(dielast: Run, recipe: Path, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    assert dielast("relax", recipe, "-q", "--plot", "none", "--depfile", "loop").returncode == 0
    assert (tmp_path / "loop").read_text().startswith("r/relax.csv ")


def test_golden_files_are_files(dielast: Run, recipe: Path, tmp_path: Path) -> None:
    assert dielast("relax", recipe, "-q", "--plot", "none", "-o", "g").returncode == 0
    (tmp_path / "g/relax.csv").unlink()
    os.mkfifo(tmp_path / "g/relax.csv")
    done = dielast("relax", recipe, "-q", "--plot", "none", "--golden", "g")
    assert done.returncode == 4
    assert done.stderr.startswith("relax.csv: not among the golden files\n")


def test_what_may_not_be_read_is_named(dielast: Run, recipe: Path, tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir()
    (locked / "x.toml").write_text(RECIPE)
    assert dielast("relax", recipe, "-q", "--plot", "none", "-o", "g").returncode == 0
    locked.chmod(0)
    try:
        done = dielast("validate", "locked/x.toml", recipe, prelude=ORDINARY)
        assert (done.returncode, done.stdout) == (2, f"{recipe}: ok\n")
        assert done.stderr == "locked/x.toml: permission denied\n"
        done = dielast("relax", recipe, "-o", "locked/out", prelude=ORDINARY)
        assert (done.returncode, done.stderr) == (2, "locked/out: cannot write here: permission denied\n")
        done = dielast("relax", recipe, "--golden", "locked", prelude=ORDINARY)
        assert (done.returncode, done.stderr) == (2, "locked: cannot be read: permission denied\n")
        (tmp_path / "g/relax.csv").chmod(0)
        done = dielast("relax", recipe, "-q", "--plot", "none", "--golden", "g", prelude=ORDINARY)
        assert (done.returncode, done.stderr) == (2, "g/relax.csv: permission denied\n")
    finally:
        locked.chmod(0o700)


def test_a_folder_that_is_gone_is_said_to_be(command: Run, recipe: Path, tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    done = command(tmp_path / "gone", "relax", recipe, "-q", "--plot", "none", prelude="import os; os.rmdir(os.getcwd())")
    assert (done.returncode, done.stderr) == (2, "the current folder is no longer there\n")
