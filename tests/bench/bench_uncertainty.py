"""What a failure map with draws costs beside the same map run once for each draw.

    python tests/bench/bench_uncertainty.py [--draws N] [--rounds N]

A map of 2 prestretches and 25 voltages, by library calls, whose bounds are compared, and by the commands that a user would type:
one `dielast failure-map` for each draw's material against one with `[uncertainty]`.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from bench_solver import branch_stages, floor

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from flat import failure_map, plan_failure_map
from synthetic import TRUTH

from dielast.handover.material_draws import draw_columns
from dielast.handover.material_file import write_material
from dielast.io.table import to_csv
from dielast.material.intervals import interval
from dielast.material.material import Material
from dielast.material.scatter import draw_sample
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.simulate.failure_map import solve_map

MAP: dict[str, Any] = {
    "voltage": np.linspace(3.4e3, 4.6e3, 25),
    "prestretch": [1.7, 1.9],
    "thickness": 5e-4,
    "horizon": 86400.0,
    "relax": 5400.0,
}


RECIPE = """kind = "failure-map"
material = "material.toml"
horizon = "24 h"
[film]
thickness = "0.5 mm"
prestretch = [1.7, 1.9]
relax = "1.5 h"
[voltage]
from = "3.4 kV"
to = "4.6 kV"
points = 25
"""


def by_command(members: list[Material], draws: int, rounds: int) -> tuple[float, float]:
    """Seconds for a command for each draw, scaled from a few, and for one with all draws."""
    call = [sys.executable, "-c", "from dielast.cli import main; main()", "failure-map", "--plot", "none", "-q"]
    alone, together = [], []
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        (here / "one.toml").write_text(RECIPE)
        (here / "all.toml").write_text(RECIPE + f"[uncertainty]\ndraws = {draws}\n")
        (here / "material.toml").write_bytes(write_material(TRUTH, "draws.csv"))
        (here / "draws.csv").write_bytes(to_csv(draw_columns(np.arange(len(members)), members)))
        for _ in range(rounds):
            for recipe, times in (("one.toml", alone), ("all.toml", together)):
                begin = time.perf_counter()
                subprocess.run([*call, recipe], cwd=here, check=True, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
                times.append(time.perf_counter() - begin)
    return draws * statistics.median(alone), statistics.median(together)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    random = np.random.default_rng(1)
    members = [
        replace(
            TRUTH,
            spectrum=Spectrum(
                TRUTH.spectrum.relaxation_time,
                TRUTH.spectrum.shear_modulus * (1 + 0.02 * random.standard_normal(len(TRUTH.spectrum))),
            ),
            shift=WLF(20.0, 13.7 + 0.03 * random.standard_normal(), 187.1),
        )
        for _ in range(options.draws)
    ]
    sample = draw_sample(members, options.draws)
    alone, together = [], []
    for _ in range(options.rounds):
        begin = time.perf_counter()
        few = [failure_map(material, **MAP) for material in members[:10]]
        alone.append((time.perf_counter() - begin) / len(few) * options.draws)
        begin = time.perf_counter()
        _, *drawn = solve_map(plan_failure_map(TRUTH, sample=sample, **MAP))
        together.append(time.perf_counter() - begin)
    slow, fast = statistics.median(alone), statistics.median(together)
    print(f"failure map of {drawn[0].time_to_failure.size} cells, {options.draws} draws, medians of {options.rounds} rounds")
    print(f"{'a run for each draw':28}{slow:9.2f} s   (10 runs, scaled)")
    print(f"{'all draws in one run':28}{fast:9.2f} s   ratio {slow / fast:.1f}")
    slow, fast = by_command(members, options.draws, options.rounds)
    print(f"{'a command for each draw':28}{slow:9.2f} s   (scaled)")
    print(f"{'one command':28}{fast:9.2f} s   ratio {slow / fast:.1f}")
    stages = branch_stages(lambda: solve_map(plan_failure_map(TRUTH, sample=sample, **MAP)))
    least = stages * floor(len(TRUTH.spectrum) + 2, 1000)[0]
    print(f"{'arithmetic of its branches':28}{least:9.2f} s   ratio {slow / least:.1f}")
    off = [np.abs(one.time_to_failure / other.time_to_failure - 1) for one, other in zip(few, drawn, strict=False)]
    print(f"largest difference of a time to failure: {np.nanmax(off):.2%}")
    low, high = interval(np.array([each.time_to_failure for each in drawn]), 0.9)
    print(f"half width of the 90 % intervals: {np.nanmin(high / low - 1) / 2:.1%} to {np.nanmax(high / low - 1) / 2:.1%}")


if __name__ == "__main__":
    main()
