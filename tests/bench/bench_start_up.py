"""Whole-process times of the command line against bare peers, as ratios of medians in interleaved runs.

Run with: python tests/bench/bench_start_up.py
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RUNS = 15
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


def main() -> None:
    python = [sys.executable, "-c"]
    with tempfile.TemporaryDirectory() as folder:
        recipe = str(Path(folder) / "recipe.toml")
        cases = []
        for kind in ("mastercurve", "spectrum", "relax", "creep", "actuate", "failure-map"):
            text = subprocess.run([*python, DIELAST, "new", kind], capture_output=True, text=True, check=True).stdout
            Path(recipe.replace("recipe", kind)).write_text(text)
            command = [*python, DIELAST, kind, f"{kind}.toml", "--plot", "none", "-q"]
            cases.append((f"dielast {kind} --plot none", command, "import numpy, pandas", [*python, "import numpy, pandas"]))
        cases.insert(0, ("dielast --help", [*python, DIELAST, "--help"], "bare typer app --help", [*python, BARE_TYPER, "--help"]))
        for name, command, peer_name, peer in cases:
            ours, theirs, ratio = compare(command, peer, folder)
            print(f"{name:32s} {ours * 1e3:6.0f} ms   {peer_name:24s} {theirs * 1e3:6.0f} ms   ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
