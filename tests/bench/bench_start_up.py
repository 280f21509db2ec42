"""Whole-process times of the command line against bare peers, as ratios of medians in interleaved runs.

The last lines are whole commands: each starter with its figure, without it, and the imports that a figure needs, in turns; in
processor seconds, which other work on the machine changes little.

Run with: python tests/bench/bench_start_up.py [RUNS]
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 15
FIGURE = "import numpy, pandas, matplotlib.figure"
KINDS = ("mastercurve", "measure", "spectrum", "relax", "creep", "actuate", "failure-map", "lifetime", "design")
BARE_TYPER = """
import typer
app = typer.Typer()
@app.command()
def first(): pass
@app.command()
def second(): pass
app()
"""
# as an installed program has it; the first run, which is not counted, writes it
WITH_BYTECODE = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
DIELAST = "from dielast.cli import main; main()"


def seconds(command: list[str], folder: str) -> float:
    start = time.perf_counter()
    subprocess.run(command, cwd=folder, env=WITH_BYTECODE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def compare(ours: list[str], peer: list[str], folder: str) -> tuple[float, float, float]:
    """Median seconds of both and their median ratio, after one run of each that is not counted."""
    seconds(ours, folder)
    seconds(peer, folder)
    pairs = [(seconds(ours, folder), seconds(peer, folder)) for _ in range(RUNS)]
    a, b = zip(*pairs, strict=True)
    return statistics.median(a), statistics.median(b), statistics.median(x / y for x, y in pairs)


def processor_seconds(command: list[str], folder: str) -> float:
    """User and system time of a command; on a system without `wait4` its time."""
    if not hasattr(os, "wait4"):
        return seconds(command, folder)
    with subprocess.Popen(command, cwd=folder, env=WITH_BYTECODE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, command
    return used.ru_utime + used.ru_stime


def whole(kind: str, folder: str) -> str:
    """A starter with its figure, without it, and the imports of a figure."""
    with_figure = [sys.executable, "-c", DIELAST, kind, f"{kind}.toml", "-q"]
    three = with_figure, [*with_figure, "--plot", "none"], [sys.executable, "-c", FIGURE]
    rows = [[processor_seconds(command, folder) for command in three] for _ in range(RUNS + 1)][1:]
    figure, computed, imports = (statistics.median(column) for column in zip(*rows, strict=True))
    more = statistics.median((row[0] - row[1]) / row[2] for row in rows)
    return (
        f"dielast {kind:12s} {figure * 1e3:6.0f} ms, without figure {computed * 1e3:6.0f} ms, {FIGURE} {imports * 1e3:6.0f} ms: "
        f"the figure takes {more:.2f} of these imports, the rest {statistics.median(row[1] / row[2] for row in rows):.2f}"
    )


def main() -> None:
    python = [sys.executable, "-c"]
    with tempfile.TemporaryDirectory() as folder:
        recipe = str(Path(folder) / "recipe.toml")
        cases = []
        for kind in KINDS:
            text = subprocess.run([*python, DIELAST, "new", kind], capture_output=True, text=True, check=True).stdout
            Path(recipe.replace("recipe", kind)).write_text(text)
            command = [*python, DIELAST, kind, f"{kind}.toml", "--plot", "none", "-q"]
            cases.append((f"dielast {kind} --plot none", command, "import numpy, pandas", [*python, "import numpy, pandas"]))
        cases.insert(0, ("dielast --help", [*python, DIELAST, "--help"], "bare typer app --help", [*python, BARE_TYPER, "--help"]))
        for name, command, peer_name, peer in cases:
            ours, theirs, ratio = compare(command, peer, folder)
            print(f"{name:32s} {ours * 1e3:6.0f} ms   {peer_name:24s} {theirs * 1e3:6.0f} ms   ratio {ratio:.2f}")
        for kind in KINDS:
            print(whole(kind, folder), flush=True)


if __name__ == "__main__":
    main()
