"""What several processes gain, as whole commands, and whether the results are the same to the byte.

    python tests/bench/bench_sharing.py [--jobs N] [--rounds N]

A map of 19,200 cells, a sweep of 4,000 cases, and a sweep of 12 films with 200 draws each; rounds with one process and with N
alternate, and medians are compared.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FILM = """
[film]
thickness = "0.5 mm"
prestretch = {prestretch}
relax = "10 min"
[breakdown]
field = "48 MV/m"
"""
RECIPES = {
    "failure-map": 'horizon = "24 h"\n[voltage]\nfrom = "3 kV"\nto = "5 kV"\npoints = 4800\n'
    + FILM.format(prestretch=[1.6, 1.7, 1.8, 1.9]),
    "relax": '[output]\npoints_per_decade = 5\n[[step]]\nstretch = 2.0\nrate = "12.5 %/s"\n[[step]]\nhold = "2 h"\n[sweep]\n'
    + f"temperature = {[f'{degC} degC' for degC in range(-20, 60)]}\n"
    + f'"step.0.rate" = {[f"{1 + 0.5 * k} %/s" for k in range(50)]}\n',
    "actuate": FILM.format(prestretch=1.9)
    + '[[step]]\nvoltage = "3 kV"\nduration = "10 s"\n[[step]]\nhold = "1 h"\n[uncertainty]\ndraws = 200\nthickness = "2 %"\n'
    + f'[sweep]\n"step.0.voltage" = {[f"{1 + 0.2 * k:.1f} kV" for k in range(12)]}\n',
}


def run(folder: Path, kind: str, jobs: int) -> tuple[float, bytes]:
    """Seconds that a command takes, and its table."""
    out = folder / f"{kind}-{jobs}"
    program = [sys.executable, "-c", "from dielast.cli import main; main()", kind, f"{kind}.toml", "-q", "--plot", "none"]
    start = time.perf_counter()
    subprocess.run([*program, "-o", out.name, "--jobs", str(jobs)], cwd=folder, check=True, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start, (out / f"{kind}.csv").read_bytes()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print(f"{'':12} {'1 process':>10} {f'{options.jobs} processes':>12} {'gain':>6}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, recipe in RECIPES.items():
            (folder / f"{kind}.toml").write_text(f'kind = "{kind}"\nmaterial = "example:vhb4905.toml"\n{recipe}')
            rounds = [(run(folder, kind, 1), run(folder, kind, options.jobs)) for _ in range(options.rounds)]
            alone, together = (statistics.median(one[side][0] for one in rounds) for side in (0, 1))
            same = "same bytes" if len({table for one in rounds for _, table in one}) == 1 else "THE TABLES DIFFER"
            print(f"{kind:12} {alone:8.2f} s {together:10.2f} s {alone / together:5.2f}x  {same}")


if __name__ == "__main__":
    main()
