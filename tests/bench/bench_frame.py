"""What a disc in a frame costs beside the homogeneous film, and beside scipy's Radau on the same semi-discrete film.

    python tests/bench/bench_frame.py [--cells N] [--no-peer]

The material and the histories are those of bench_voltage.py, N = 30 branches, with an electrode of 10 mm in a frame of 190.5 mm:
the paper's Fig. 9, and a map of N x N (50 x 50) voltages and prestretches. Times are of the processor, the best of three, as the
machine may be shared. The peer (tests/peers/disc.py) has the exact Jacobian of all unknowns as a sparse matrix; it takes
dielast's points around the disc, and then linear elements. Each is compared with the loosest of its tolerances by which the
stretch is exact to 1e-5, that of a film with points to 1e-10; one run of dielast, and 100 together.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from bench_solver import vhb
from bench_voltage import FIELD, HORIZON, PERMITTIVITY, PRESTRETCHES, RELAX, RTOL, THICKNESS, VOLTAGES
from flat import actuate, failure_map

from dielast import FailureMap, VoltageStep
from dielast.mechanics.passive import forms

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from peers.disc import DiscRun, Drive, Structure, disc as peer_disc
from peers.energies import gent
from peers.membrane import Film, constant, ramp
from scipy.sparse import csr_array

SHARE, PRESTRETCH, POINTS = 10 / 190.5, 1.9, 4
FRAMED: dict[str, Any] = {"boundary": "frame", "electrode_share": SHARE}
ELEMENTS = 16  # exact to about 1e-5 here
EXACT = 1e-5
HIGHER = 1.35  # voltage of a disc in a frame that moves as far
FIG_9 = ((0.0, 2500.0, 10.0), (2500.0, 2500.0, 300.0), (2500.0, 3000.0, 10.0), (3000.0, 3000.0, 6880.0))


def cost(job: Callable[[], Any], repeats: int = 3) -> tuple[float, Any]:
    """The least seconds of processor time, and the result."""
    least, result = np.inf, None
    for _ in range(repeats):
        begin = time.process_time()
        result = job()
        least = min(least, time.process_time() - begin)
    return least, result


def loosest(run: Callable[[float], np.ndarray], exact: np.ndarray, repeats: int) -> tuple[float, float, float]:
    """Seconds, tolerance and error of the loosest of some tolerances by which a run is `EXACT`, or of the last."""
    for rtol in 10.0 ** np.arange(-2, -9, -1):
        seconds, found = cost(lambda rtol=rtol: run(rtol), repeats)
        error = float(np.max(np.abs(found / exact - 1)))
        if error <= EXACT:
            break
    return seconds, float(rtol), error


def fig_9(material: Any, rtol: float, higher: Any, **film: Any) -> Any:
    """The paper's Fig. 9, the relative stretch at the end of each step."""
    steps = [VoltageStep(higher * end, duration=lasts) for _, end, lasts in FIG_9]
    given: dict[str, Any] = {"thickness": THICKNESS, "prestretch": PRESTRETCH, "relax": RELAX, "stop_at": "end", "rtol": rtol}
    return actuate(material, steps, **given, **film, times=np.cumsum([lasts for *_, lasts in FIG_9])).relative_stretch_1[0]


def radau(material: Any, rtol: float, elements: int = 0) -> np.ndarray:
    """The same film by Radau, or so many linear elements."""
    disc = forms.disc(np.array([SHARE]), np.array([PRESTRETCH]), POINTS)
    gather = disc.gather[..., 0].transpose(1, 0, 2).reshape(-1, disc.unknowns)
    active, none = np.arange(disc.points) == 0, np.zeros(disc.unknowns)
    fixed = disc.fixed[..., 0].T.reshape(-1, 1)
    same = Structure(disc.weight[:, 0], csr_array(gather), fixed, disc.home, active, none, np.zeros(disc.points))
    spectrum = material.spectrum
    film = Film(
        lambda l1, l2: gent(l1, l2, material.equilibrium_modulus, 110.0),
        lambda l1, l2: gent(l1, l2, 1.0, 55.0),
        spectrum.shear_modulus,
        spectrum.relaxation_time,
        PERMITTIVITY,
    )
    if elements:  # equal parts of 1/R^2, which suit them best
        same = peer_disc(np.linspace(1.0, SHARE**2, elements + 1) ** -0.5)
    held = (constant(PRESTRETCH if elements else 1.0),)
    drives = [Drive(RELAX, held)]
    for begin, end, lasts in FIG_9:
        drives.append(Drive(lasts, held, ramp(HIGHER * begin / THICKNESS, HIGHER * end / THICKNESS, lasts)))
    run = DiscRun(film, same, drives, rtol=rtol, atol=rtol)
    begin = float(run.at(RELAX).u[0, 0])
    return np.array([run.at(RELAX + when).u[0, 0] / begin for when in np.cumsum([lasts for *_, lasts in FIG_9])])


def grid(material: Any, cells: int, higher: float, **film: Any) -> FailureMap:
    """A map."""
    volts, stretches = higher * np.linspace(*VOLTAGES, cells), np.linspace(*PRESTRETCHES, cells)
    given: dict[str, Any] = {"thickness": THICKNESS, "horizon": HORIZON, "relax": RELAX, "rtol": RTOL}
    return failure_map(material, voltage=volts, prestretch=stretches, **given, **film)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, default=50)
    parser.add_argument("--no-peer", action="store_true")
    asked = parser.parse_args()
    material = replace(vhb(30), permittivity=PERMITTIVITY, breakdown=FIELD)
    for rtol in (1e-5, 1e-6):
        alone, _ = cost(lambda rtol=rtol: fig_9(material, rtol, 1.0))
        framed, there = cost(lambda rtol=rtol: fig_9(material, rtol, HIGHER, **FRAMED))
        print(f"Fig. 9 to {rtol:g}: homogeneous {alone:.3f} s, in a frame {framed:.3f} s, {framed / alone:.1f} times")
        tight = fig_9(material, 1e-9, HIGHER, **FRAMED)
        print(f"    error of the stretch {np.max(np.abs(there / tight - 1)):.1e}")
    if not asked.no_peer:
        exact = fig_9(material, 1e-10, HIGHER, **FRAMED, mesh_rtol=1e-10)
        ours, rtol, error = loosest(lambda rtol: fig_9(material, rtol, HIGHER, **FRAMED), exact, 3)
        batch, _ = cost(lambda: fig_9(material, rtol, np.full(100, HIGHER), **FRAMED))
        print(f"to {EXACT:g}: dielast with rtol {rtol:g}, {ours:.3f} s, {batch / 100:.4f} s as one of 100, error {error:.1e}")
        for elements in (0, ELEMENTS):
            peer, rtol, error = loosest(lambda rtol, elements=elements: radau(material, rtol, elements), exact, 1)
            mesh = f"{elements} linear elements" if elements else "same points"
            print(f"    Radau with rtol {rtol:g}, {mesh}: {peer:.1f} s, error {error:.1e}: {peer / ours:.0f} times one run,")
            print(f"    {100 * peer / batch:.0f} times one of 100 together")
    count = asked.cells**2
    alone, _ = cost(lambda: grid(material, asked.cells, 1.0), 2)
    framed, found = cost(lambda: grid(material, asked.cells, HIGHER, **FRAMED), 1)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"map of {count} cells: homogeneous {1e3 * alone / count:.2f} ms a cell, in a frame {1e3 * framed / count:.2f} ms, "
        f"{framed / alone:.1f} times; at most {memory:.2f} GiB; {np.mean(found.failure_mode == 'breakdown'):.0%} break down"
    )


if __name__ == "__main__":
    main()
