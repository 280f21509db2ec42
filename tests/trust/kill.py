"""Kill writing commands at random moments: `python tests/trust/kill.py --runs 300` (of each command; `--help` for more).

Each run writes a new result into a folder that holds an older one, and gets SIGKILL, SIGTERM, SIGINT or SIGHUP somewhere between
its start and a little after its usual end, or, every other one, while it writes its files, half of these with slow moves.
Afterwards every file must be the older one or the new one, whole, no traceback was printed, and no process of the run is alive a
little later. A folder with files of both results must not pass for whole, and only SIGKILL may leave one. A run that is then left
alone must leave the new result and nothing else, going on from what was kept.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from pathlib import Path

from dielast.commands.registry import COMMANDS
from dielast.io.manifest import FIGURES, SUMMARY, altered, is_of_run, unlisted

TOP = Path(__file__).resolve().parents[2]
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
OURS = re.compile(r'dielast.cli.__init__.py", line \d+, in main')  # in a traceback
CHANGES = {  # what tells the new result from the older one
    "mastercurve": ["--set", "shift.reference_temperature='10 degC'"],
    "spectrum": ["--set", "fit.branches=25"],
    "mastercurve --set uncertainty.draws=20": ["--set", "shift.reference_temperature='10 degC'"],
    "design": ["--set", "goal.at='2 h'"],
    "lifetime": ["--set", "uncertainty.level=0.8"],
    "relax": ["--set", "temperature='10 degC'"],
    "creep": ["--set", "temperature='10 degC'"],
    "actuate": ["--set", "temperature='10 degC'"],
    "measure": ["--set", "interval='9 s'"],
    "failure-map": ["--set", "voltage.points=3000", "--set", "horizon='2 h'"],
}
DRAWN = """
[uncertainty]
draws = 100
thickness = "2 %"
breakdown_field = { law = "weibull", shape = 20 }
"""
SWEPT = f"""
kind = "actuate"
material = "example:vhb4905.toml"
output = {{ points_per_decade = 2 }}
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "10 min"
[[step]]
voltage = "2 kV"
duration = "10 s"
[[step]]
hold = "1 h"
[breakdown]
field = "48 MV/m"
[sweep]
"step.0.voltage" = {[f"{1000 + 30 * step} V" for step in range(100)]}
"temperature" = {[f"{10 + step / 2} degC" for step in range(50)]}
"""
MAPPED = """
kind = "failure-map"
material = "example:vhb4905.toml"
horizon = "1 d"
[film]
thickness = "0.5 mm"
prestretch = [1.6, 1.8]
relax = "10 min"
[voltage]
from = "3 kV"
to = "5 kV"
points = 1500
[breakdown]
field = "48 MV/m"
"""
FITTED = """
kind = "calibrate"
material = "example:tensile/start.toml"
[[test]]
file = "example:tensile/fast.csv"
specimen = { gauge_length = "80 mm", width = "22 mm", thickness = "1 mm" }
temperature = "20 degC"
[free]
"equilibrium.shear_modulus" = {}
"nonequilibrium.scale" = {}
[fit]
starts = 4
[uncertainty]
draws = 20
"""
STUDIES = {  # long runs, with the recipe to be run, or what its starter ends with
    "actuate +sweep": (SWEPT, ["--set", "film.relax='20 min'"]),
    "actuate +draws": (DRAWN, ["--set", "temperature='10 degC'"]),
    "design +draws": (DRAWN, ["--set", "goal.at='2 h'"]),
    "failure-map --jobs 2 +map": (MAPPED, ["--set", "horizon='2 h'"]),
    "calibrate --jobs 2 +fit": (FITTED, ["--set", "fit.starts=5"]),
}
CHANGES |= {kind: changes for kind, (_, changes) in STUDIES.items()}
SLOW = "import os, time; move = os.replace; os.replace = lambda a, b: (move(a, b), time.sleep(0.2 * (a != b)));"
SURVIVAL = 3.0  # s that a process may outlive the run that started it


def command(kind: str, recipe: Path, out: Path, *more: str, slow: bool = False) -> list[str]:
    """The command line of a run, perhaps with slow moves of files; `kind` may have options, and after a plus one of `STUDIES`."""
    name, *options = kind.partition("+")[0].split()
    launch = [sys.executable, "-c", SLOW * slow + "from dielast.cli import main; main()"]
    return [*launch, name, str(recipe), "-q", "-o", str(out), *options, *more]


def files(folder: Path) -> dict[str, bytes]:
    """Every file of a folder, by name."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())} if folder.is_dir() else {}


def whole(now: dict[str, bytes], older: dict[str, bytes], newer: dict[str, bytes]) -> list[str]:
    """What is wrong with the files after a run was killed."""
    wrong = [f"{name} is neither old nor new" for name, content in now.items() if content not in (older.get(name), newer.get(name))]
    return [line for line in wrong if not line.startswith(".")] + [f"{name} is gone" for name in older if name not in now]


def passes(now: dict[str, bytes]) -> bool:
    """Whether the files of a folder pass for those of one run."""
    if SUMMARY not in now:
        return False
    summary, shown = tomllib.loads(now[SUMMARY].decode()), {name: each for name, each in now.items() if not name.startswith(".")}
    own = all(is_of_run(summary, name, each) for name, each in shown.items() if name.endswith(FIGURES))
    return own and not altered(summary, shown) and not unlisted(summary, shown)


def wait(process: subprocess.Popen[str], seconds: float) -> float:
    """Give a process some time; returns it."""
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(seconds)
    return seconds


def alive(session: int) -> list[int]:
    """The processes of a session, but for those that are dead and not yet buried; none where the system has no /proc."""
    found: list[int] = []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            state, _, _, own, *_ = (entry / "stat").read_text().rpartition(")")[2].split()
            found += [int(entry.name)] if int(own) == session and state not in "ZX" else []
    return found


def survivors(session: int) -> list[int]:
    """What is still alive of a session after some time; it is killed then."""
    deadline = time.monotonic() + SURVIVAL
    while (found := alive(session)) and time.monotonic() < deadline:
        time.sleep(0.02)
    for process in found:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    return found


def writing(process: subprocess.Popen[str], out: Path, rng: random.Random) -> float:
    """Wait until a process begins to write into its folder, and a little more; returns how long in s."""
    begin, state = time.perf_counter(), out.stat().st_mtime_ns
    while process.poll() is None and out.stat().st_mtime_ns == state:
        time.sleep(0.0005)
    wait(process, rng.choice((0.0, 0.001, 0.01, 1.0)) * rng.random())
    return time.perf_counter() - begin


def batter(kind: str, runs: int, seconds: float, rng: random.Random, scratch: Path) -> list[str]:
    """Kill up to `runs` runs of a command, none of which begins after so many `seconds`; returns what went wrong."""
    deadline = time.monotonic() + seconds
    name = kind.split()[0]
    recipe = scratch / f"{name}.toml"
    text, _ = STUDIES.get(kind, ("", []))
    recipe.write_text(text if "kind" in text else COMMANDS[name].starter() + text)
    old, new, out = (scratch / f"{kind}-{state}".replace(" ", "") for state in ("old", "new", "out"))
    subprocess.run(command(kind, recipe, old), check=True)
    begin = time.perf_counter()
    subprocess.run(command(kind, recipe, new, *CHANGES[kind]), check=True)
    usual = time.perf_counter() - begin
    older, newer = files(old), files(new)
    assert older.keys() == newer.keys()
    assert older != newer
    found, ends, went_on, kept = [], Counter[str](), 0, Counter[str]()
    run = 0
    while run < runs and time.monotonic() < deadline:
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(old, out)
        blow = rng.choice(SIGNALS)
        process = subprocess.Popen(
            command(kind, recipe, out, *CHANGES[kind], slow=run % 4 == 3), stderr=subprocess.PIPE, text=True, start_new_session=True
        )
        # half of the blows fall while the files are written
        moment = writing(process, out, rng) if run % 2 else wait(process, rng.uniform(0, 1.1 * usual))
        if process.poll() is None:
            # a scheduler of jobs, a terminal and timeout strike all the processes of a run
            rng.choice((os.kill, os.killpg))(process.pid, blow)
        process.wait()
        left = survivors(process.pid)
        said = process.communicate()[1]
        code = process.returncode
        early = code in (1, -signal.SIGINT) and not OURS.search(said)  # Python itself was still starting
        ends["as Python starts" if early else f"exit {code}"] += 1
        where = f"{kind}, run {run}, {blow.name} after {moment:.3f} s, exit {code}"
        now, before = files(out), len(found)
        # an interrupted calibration writes the best fit so far
        found += [f"{where}: {line}" for line in whole(now, older, newer) if "the best fit so far is written" not in said]
        shown = {name: content for name, content in now.items() if not name.startswith(".")}
        mixed = shown not in (older, newer) and "the best fit so far is written" not in said
        if mixed and passes(now):
            found.append(f"{where}: a mixed folder passes for whole")
        if mixed and blow is not signal.SIGKILL:
            found.append(f"{where}: a mixed folder")
        if left:
            found.append(f"{where}: {len(left)} processes stay behind")
        if "Traceback" in said and not early:
            found.append(f"{where}: a traceback: {' | '.join(said.split(chr(10))[-30:])}")
        kept["new" if all(now.get(name) == newer[name] for name in newer) else "old" if now == older else "between"] += 1
        went_on += ".unfinished" in now
        if run % 10 == 0 or ".unfinished" in now:  # left alone, the next run finishes, with the same bytes
            subprocess.run(command(kind, recipe, out, *CHANGES[kind]), check=True)
            if files(out) != newer:
                found.append(f"{where}: the next run does not leave the new result: {sorted(files(out))}")
        print(*found[before:], sep="\n", end="\n" * (len(found) > before), flush=True)
        run += 1
    told = ", ".join(f"{name} {count}" for name, count in sorted(ends.items()))
    states = ", ".join(f"{name} {count}" for name, count in sorted(kept.items()))
    print(
        f"{kind:20} {run} runs of {usual:.2f} s: {told}; results {states}; to go on from {went_on}; wrong {len(found)}", flush=True
    )
    return found


def main() -> None:
    """Batter the commands that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", nargs="*", help="all if none is named")
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seconds", type=float, default=math.inf, help="for each command, after which no run begins")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what a job in the background starts would ignore it
    with tempfile.TemporaryDirectory() as folder:
        found = []
        for kind in options.kind or CHANGES:
            found += batter(kind, options.runs, options.seconds, random.Random(f"{options.seed} {kind}"), Path(folder))
    print(f"{len(found)} wrong" if found else "every file whole")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
