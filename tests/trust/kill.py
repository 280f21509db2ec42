"""Kill writing commands at random moments: `python tests/trust/kill.py --runs 300` (of each command; `--help` for more).

Each run writes a new result into a folder that holds an older one, and gets SIGKILL, SIGTERM or SIGINT somewhere between its
start and a little after its usual end. Afterwards every file must be the older one or the new one, whole, and no traceback was
printed; a run that is then left alone must leave the new result and nothing else, a failure map going on from what it had.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
CHANGES = {  # what tells the new result from the older one
    "mastercurve": ["--set", "shift.reference_temperature='10 degC'"],
    "spectrum": ["--set", "fit.branches=25"],
    "relax": ["--set", "temperature='10 degC'"],
    "creep": ["--set", "temperature='10 degC'"],
    "actuate": ["--set", "temperature='10 degC'"],
    "failure-map": ["--set", "voltage.points=3000", "--set", "horizon='2 h'"],
}


def command(kind: str, recipe: Path, out: Path, *more: str) -> list[str]:
    """The command line of a run."""
    return [sys.executable, "-c", "from dielast.cli import main; main()", kind, str(recipe), "-q", "-o", str(out), *more]


def files(folder: Path) -> dict[str, bytes]:
    """Every file of a folder, by name."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())} if folder.is_dir() else {}


def whole(now: dict[str, bytes], older: dict[str, bytes], newer: dict[str, bytes]) -> list[str]:
    """What is wrong with the files after a run was killed."""
    wrong = [f"{name} is neither old nor new" for name, content in now.items() if content not in (older.get(name), newer.get(name))]
    return [line for line in wrong if not line.startswith(".")] + [f"{name} is gone" for name in older if name not in now]


def batter(kind: str, runs: int, rng: random.Random, scratch: Path) -> list[str]:
    """Kill `runs` runs of a command; returns what went wrong."""
    recipe = scratch / f"{kind}.toml"
    shutil.copy(TOP / "dielast" / "starters" / f"{kind}.toml", recipe)
    old, new, out = scratch / f"{kind}-old", scratch / f"{kind}-new", scratch / f"{kind}-out"
    subprocess.run(command(kind, recipe, old), check=True)
    begin = time.perf_counter()
    subprocess.run(command(kind, recipe, new, *CHANGES[kind]), check=True)
    usual = time.perf_counter() - begin
    older, newer = files(old), files(new)
    assert older.keys() == newer.keys()
    assert older[f"{kind}.csv"] != newer[f"{kind}.csv"]
    found, ends, went_on, kept = [], Counter[str](), 0, Counter[str]()
    for run in range(runs):
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(old, out)
        blow = rng.choice(SIGNALS)
        process = subprocess.Popen(command(kind, recipe, out, *CHANGES[kind]), stderr=subprocess.PIPE, text=True)
        # a third of the blows fall where the files are written
        moment = rng.uniform(0, 1.1 * usual) if rng.random() < 0.67 else rng.uniform(0.85, 1.1) * usual
        try:
            process.wait(moment)
        except subprocess.TimeoutExpired:
            os.kill(process.pid, blow)
        said = process.communicate()[1]
        code = process.returncode
        ends[f"exit {code}"] += 1
        where = f"{kind}, run {run}, {blow.name} after {moment:.3f} s, exit {code}"
        now = files(out)
        found += [f"{where}: {line}" for line in whole(now, older, newer)]
        if "Traceback" in said:
            found.append(f"{where}: a traceback: {said.splitlines()[-1]}")
        kept["new" if all(now.get(name) == newer[name] for name in newer) else "old" if now == older else "between"] += 1
        went_on += ".unfinished" in now
        if run % 10 == 0:  # left alone, the next run finishes, with the same bytes
            subprocess.run(command(kind, recipe, out, *CHANGES[kind]), check=True)
            if files(out) != newer:
                found.append(f"{where}: the next run does not leave the new result: {sorted(files(out))}")
    told = ", ".join(f"{name} {count}" for name, count in sorted(ends.items()))
    states = ", ".join(f"{name} {count}" for name, count in sorted(kept.items()))
    print(
        f"{kind:12} {runs} runs of {usual:.2f} s: {told}; results {states}; to go on from {went_on}; wrong {len(found)}", flush=True
    )
    return found


def main() -> None:
    """Batter the commands that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", nargs="*", help="all if none is named")
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what a job in the background starts would ignore it
    with tempfile.TemporaryDirectory() as folder:
        found = []
        for kind in options.kind or CHANGES:
            found += batter(kind, options.runs, random.Random(f"{options.seed} {kind}"), Path(folder))
    print("\n".join(found[:40]) or "every file whole")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
