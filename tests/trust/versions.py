"""How far results move with versions and threads: `python tests/trust/versions.py` (makes environments, which takes minutes).

Every golden recipe runs with the newest and with the oldest versions that are allowed of every dependency, with one and with two
threads of the linear algebra library, and with every other Python that is found. Shown is the largest relative difference from the
golden numbers, and where it is; what differs in more than digits is an error.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
GOLDEN = TOP / "tests" / "golden"
PYTHONS = ("python3.11", "python3.12", "python3.13", "python3.14")
LEAST = 1e-12


def oldest() -> list[str]:
    """The oldest version that is allowed of every dependency."""
    wanted = tomllib.loads((TOP / "pyproject.toml").read_text())["project"]["dependencies"]
    pins = []
    for entry in wanted:
        match = re.fullmatch(r"([A-Za-z0-9_-]+)>=([0-9.]+)(,<.*)?", entry)
        assert match is not None, entry
        pins.append(f"{match[1]}=={match[2]}")
    return pins


def runs(python: str) -> bool:
    """Whether this Python is there and starts: some that are found only say that they are not installed."""
    return shutil.which(python) is not None and subprocess.run([python, "--version"], capture_output=True).returncode == 0


def environment(folder: Path, python: str, pins: list[str]) -> Path:
    """A virtual environment with dielast and the versions of `pins`; its interpreter."""
    subprocess.run([python, "-m", "venv", folder], check=True)
    interpreter = folder / "bin" / "python"
    subprocess.run([interpreter, "-m", "pip", "install", "--quiet", str(TOP), *pins], check=True, stderr=subprocess.DEVNULL)
    return interpreter


def write_results(out: Path) -> None:
    """Run every golden recipe with this interpreter's dielast into `out`."""
    from dielast.cli.run import compute
    from dielast.commands.registry import read_cases
    from dielast.io.files import write_files
    from dielast.sharing.execution import Execution

    for recipe in sorted(GOLDEN.glob("*/recipe.toml")):
        kind = tomllib.loads(recipe.read_text())["kind"]
        write_files(out / recipe.parent.name, compute(kind, read_cases(recipe, kind, ()), recipe, (), Execution())[0])


def compare(out: Path) -> tuple[float, str, list[str]]:
    """The largest relative difference of a number from the golden one, where it is, and what differs otherwise."""
    from dielast.report.golden import NEGLIGIBLE, differences, golden_files, tolerances

    worst, where, other = 0.0, "", []
    for folder in sorted(path.parent for path in GOLDEN.glob("*/recipe.toml")):
        contents = {path.name: path.read_bytes() for path in (out / folder.name).iterdir()}
        with tempfile.TemporaryDirectory() as bare:  # without the folder's own tolerances
            for path in (folder / "expected").glob("*"):
                if path.name != "tolerance.toml":
                    shutil.copy(path, bare)
            rounding = {
                column
                for columns in tolerances(folder / "expected", golden_files(folder / "expected")).values()
                for column in columns
            }
            for line in differences(contents, Path(bare), NEGLIGIBLE):
                match = re.fullmatch(r"(.*): (\S+); golden (\S+)", line)
                if any(f": {column}: " in line for column in rounding):
                    continue
                try:
                    assert match is not None
                    now, then = float(match[2]), float(match[3])
                except (AssertionError, ValueError):
                    other.append(f"{folder.name}: {line}")
                    continue
                gap = abs(now - then) / max(abs(now), abs(then))
                if gap > worst:
                    worst, where = gap, f"{folder.name}: {match[1]}"
        other += [f"{folder.name}: {line}" for line in differences(contents, folder / "expected", 1e-6)]
    return worst, where, other


def main() -> None:
    """Make the environments, run, compare, tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, help="only run every recipe into this folder")
    parser.add_argument("--python", action="append", help="an interpreter to use; repeatable; by default those found on the path")
    options = parser.parse_args()
    if options.run is not None:
        write_results(options.run)
        return
    wrong = 0
    with tempfile.TemporaryDirectory() as scratch:
        cases = []
        for python in filter(runs, options.python or PYTHONS):
            cases += [(python, "newest", [], threads) for threads in (1, 2)] + [(python, "oldest", oldest(), 1)]
        print(f"{'python':12} {'versions':8} {'numpy':8} {'scipy':8} threads  largest difference")
        for python, name, pins, threads in cases:
            folder = Path(scratch) / f"{abs(hash(python))}-{name}"
            try:
                interpreter = folder / "bin" / "python" if folder.exists() else environment(folder, python, pins)
            except subprocess.CalledProcessError:
                print(f"{python}: the {name} versions cannot be installed", flush=True)
                continue
            out = Path(scratch) / f"out-{folder.name}-{threads}"
            settings = {name: str(threads) for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}
            subprocess.run([interpreter, __file__, "--run", out], check=True, env=os.environ | settings, cwd=scratch)
            said = "import platform, numpy, scipy; print(platform.python_version(), numpy.__version__, scipy.__version__)"
            version, numpy, scipy = subprocess.run(
                [interpreter, "-c", said], capture_output=True, text=True, check=True
            ).stdout.split()
            worst, where, other = compare(out)
            print(f"{version:12} {name:8} {numpy:8} {scipy:8} {threads:7}  {max(worst, LEAST):.1e}  {where}", flush=True)
            for line in other[:10]:
                print(f"    {line}")
            wrong += len(other)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
