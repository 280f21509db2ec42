"""The commands as on Windows and on macOS: without what only POSIX or Linux has, on a console of 256 characters, with CRLF.

What is simulated is what Python lacks there; file systems, consoles and process trees stay those of the machine that tests.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from maps import map_of
from processes import ENDS, Run

from dielast.cli import terminal
from dielast.io import workbook
from dielast.io.files import depfile

# every process that a test starts imports this first, also those that processes start
SIMULATED = """
import os, pathlib, signal, sys, warnings

def refuse(*arguments):
    raise AssertionError("os.kill is no question on Windows: 0 stands for Ctrl-C")

def read_text(path, *arguments, **options):
    if path.parts[:2] in (("/", "proc"), ("/", "sys")):
        raise FileNotFoundError(2, "No such file or directory", str(path))
    return read(path, *arguments, **options)

read, pathlib.Path.read_text = pathlib.Path.read_text, read_text
for name in ("sched_getaffinity", "sched_setaffinity", "fork", "forkpty"):
    vars(os).pop(name, None)
if os.environ["SYSTEM"] == "Windows":
    sys.modules.update(dict.fromkeys(("fcntl", "grp", "pty", "pwd", "resource", "termios")))
    for name in ("getuid", "geteuid", "getgid", "getpgid", "killpg", "setsid", "sysconf", "mkfifo", "O_DIRECTORY", "statvfs"):
        vars(os).pop(name, None)
    for name in ("SIGALRM", "SIGHUP", "SIGKILL", "SIGUSR1", "alarm", "pthread_kill", "pthread_sigmask", "setitimer", "sigwait"):
        vars(signal).pop(name, None)
    os.kill = refuse
    warnings.simplefilter("ignore", EncodingWarning)
    warnings.filterwarnings("error", category=EncodingWarning, module="dielast")
else:
    import resource
    def setrlimit(*arguments):
        raise ValueError("current limit exceeds maximum limit")
    resource.setrlimit = setrlimit
"""
MATERIAL = 'kind = "{}"\nmaterial = "Ergebnisse/spectrum/material.toml"\n'
FILM = 'film = { thickness = "0.5 mm", prestretch = 1.9 }\nbreakdown = { field = "45 MV/m" }\n'
RECIPES = {
    "mastercurve": 'kind = "mastercurve"\n[data]\nfile = "Messung bei 20 °C/größe.csv"\n'
    'columns = { temperature = "temperature", modulus = "relaxation_modulus" }\nramp = "1 s"\n'
    '[shift]\nreference_temperature = "20 °C"\n',
    "spectrum": (
        'kind = "spectrum"\nmastercurve = "Ergebnisse/mastercurve"\n[fit]\nequilibrium_modulus = "0.078 MPa"\n'
        'branches = 8\n[material]\npermittivity = "3.98e-11 F/m"\n'
    ),
    "relax": MATERIAL.format("relax") + '[[step]]\ntable = "Messung bei 20 °C/history.csv"\n',
    "creep": MATERIAL.format("creep") + '[[step]]\nstress = "20 kPa"\nrate = "10 kPa/s"\n[[step]]\nhold = "1 min"\n',
    "actuate": MATERIAL.format("actuate") + FILM + '[[step]]\nvoltage = "4 kV"\nduration = "10 s"\n',
    "design": MATERIAL.format("design") + FILM.replace("1.9", '[1.7, 1.9], relax = "1 min"') + "goal = "
    '{ relative_stretch = 1.1, at = "1 min", horizon = "1 h" }\n',
}


# all command lines in one process: starting it takes longer than most of them
LINES = """
import json, sys
from dielast.cli import main
if __name__ == "__main__":
    for line in json.loads(sys.argv[1]):
        sys.argv[1:] = line
        try:
            main()
        except SystemExit as end:
            if end.code:
                raise
"""


def elsewhere(system: str, folder: Path, *lines: list[str]) -> subprocess.CompletedProcess[bytes]:
    """Run command lines of dielast in the folder as on another system, up to one that fails; what they print comes in its bytes."""
    site = folder.parent / "site"
    site.mkdir(exist_ok=True)
    (site / "sitecustomize.py").write_text(SIMULATED, encoding="utf-8")
    (site / "lines.py").write_text(LINES, encoding="utf-8")
    variables = {"SYSTEM": system, "PYTHONPATH": str(site), "PYTHONIOENCODING": "cp1252", "PYTHONWARNDEFAULTENCODING": "1"}
    command = [sys.executable, str(site / "lines.py"), json.dumps(lines)]
    return subprocess.run(command, cwd=folder, env=os.environ | variables, capture_output=True, timeout=ENDS, check=False)


@pytest.fixture
def kitchen(tmp_path: Path) -> Path:
    """Recipes and tables as an editor of Windows saves them."""
    folder = tmp_path / "Prüfstand ≤ 1"
    (folder / "Messung bei 20 °C").mkdir(parents=True)
    table = (Path(terminal.__file__).parents[1] / "examples" / "relaxation-test.csv").read_text(encoding="utf-8")
    tables = {"größe.csv": table, "history.csv": "time [s],stretch [1]\n1,1.1\n10,1.5\n"}
    for name, text in tables.items():
        (folder / "Messung bei 20 °C" / name).write_text(text, encoding="utf-8", newline="\r\n")
    for kind, text in RECIPES.items():
        (folder / f"{kind}.toml").write_text(text, encoding="utf-8", newline="\r\n")
    return folder


def test_six_commands_give_the_same_bytes_as_on_windows(kitchen: Path, command: Run) -> None:
    options = {kind: ["--plot", "none"] for kind in RECIPES} | {"creep": []}
    options["relax"] += ["--depfile", "d", "--json"]
    mistake = ["validate", str(kitchen / "spectrum.toml"), "no ≤.toml"]
    lines = [[kind, f"{kind}.toml", "-o", f"Ergebnisse/{kind}", *own] for kind, own in options.items()]
    there = elsewhere("Windows", kitchen, *lines, mistake)
    assert (there.returncode, there.stderr.decode("cp1252").strip()) == (2, r"no \u2264.toml: no such file")
    assert rb"\u2264 1" in there.stdout
    there.stdout.decode("cp1252")
    for kind, own in options.items():
        out, golden = kitchen / "Ergebnisse" / kind, kitchen / "golden" / kind
        # a golden file that was checked out with CRLF is the same
        shutil.copytree(out, golden)
        for path in golden.glob("*.csv"):
            assert b"\r" not in path.read_bytes()
            path.write_text(path.read_text(encoding="utf-8"), encoding="utf-8", newline="\r\n")
        here = command(kitchen, kind, f"{kind}.toml", "-o", f"here/{kind}", *own, "--golden", golden, "--rtol", "0")
        assert (here.returncode, here.stderr) == (0, "")
        for path in (kitchen / "here" / kind).iterdir():
            assert path.read_bytes() == (out / path.name).read_bytes()


@pytest.mark.trust
@pytest.mark.parametrize("system", ["macOS", "Windows"])
def test_a_map_is_shared_out_as_on_another_system(kitchen: Path, system: str) -> None:
    (kitchen / "map.toml").write_text(map_of(200), encoding="utf-8")
    map_of_two = ["failure-map", "map.toml", "--plot", "none", "-q", "-o"]
    done = elsewhere(system, kitchen, [*map_of_two, "two", "--jobs", "2"], [*map_of_two, "one"])
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")
    assert (kitchen / "two/failure-map.csv").read_bytes() == (kitchen / "one/failure-map.csv").read_bytes()


def test_recipes_as_windows_writes_and_names_them(tmp_path: Path, dielast: Run) -> None:
    recipe = 'kind = "mastercurve"\n[data]\nfile = {}\n[shift]\nreference_temperature = "20 degC"\n'
    slashes = "write / between folders"
    escape = r"a backslash in double quotes begins an escape such as \t: "
    hints = {
        r'"daten\test.csv"': rf'data.file: "daten\test.csv": no such file; {escape}{slashes}, or single quotes',
        r"'daten\messung.csv'": rf"data.file: 'daten\messung.csv': no such file; {slashes}: it does on every system",
        r'"daten\messung.csv"': rf"line 3: not TOML: unescaped '\' in a string; in a path {slashes}, or use single quotes",
        r'"C:\Users\x.csv"': f"line 3: not TOML: invalid hex value; in a path {slashes}, or use single quotes",
    }
    for name, hint in hints.items():
        (tmp_path / "r.toml").write_text(recipe.format(name), encoding="utf-8")
        done = dielast("validate", "r.toml")
        assert (done.returncode, done.stderr.splitlines()[0]) == (2, f"r.toml: {hint}")
    # > in Windows PowerShell
    (tmp_path / "r.toml").write_text(dielast("new", "relax").stdout, encoding="utf-16", newline="\r\n")
    assert dielast("validate", "r.toml").stdout == "r.toml: ok\n"


def test_what_only_windows_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its calls, answered as its documentation says."""
    monkeypatch.setattr(os.path, "splitdrive", lambda name: (name[:2], name[2:]) if name[1:2] == ":" else ("", name))
    monkeypatch.setattr(os.path, "relpath", lambda path: str(path))
    assert depfile([Path("C:/out/a b.csv")], [Path("D:/c:d.csv")]) == "C:/out/a\\ b.csv: D:/c\\:d.csv\n\nD:/c\\:d.csv:\n"
    error = OSError(22, "Invalid argument")
    assert not terminal.is_unread(error)
    monkeypatch.setattr(terminal.os, "name", "nt")
    assert terminal.is_unread(error)


def test_a_system_that_bounds_no_memory_reads_workbooks(monkeypatch: pytest.MonkeyPatch) -> None:
    resource = pytest.importorskip("resource")

    def refuse(*_: object) -> None:
        raise ValueError("current limit exceeds maximum limit")

    monkeypatch.setattr(resource, "setrlimit", refuse)
    workbook._bound_memory()
