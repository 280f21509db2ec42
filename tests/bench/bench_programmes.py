"""Programmes of edges and electrodes: random ones against the membrane peer, the energy of many cycles, and the time of a cycle.

    python tests/bench/bench_programmes.py [--programmes N] [--balance N] [--cycles N]

Of N random programmes it prints the worst relative difference of stretches, stresses, voltage, charge and events; of N cycles with
branches, resistance and leakage, what the balance of energy lacks; and the time of one of N generator cycles of 30 branches, with
that of a creep test of 6 h beside it, and the memory. A cycle has four kinks and about 64 tried steps, the creep test two and 99.
Of 1,000 cycles, one took 0.94 times the creep test (66 and 70 ms on a loaded machine; 0.85 times, 52 and 62 ms, alone); the largest
memory was 120 MiB after 10, 100 and 1,000 cycles. The energies of 100 cycles lack 7.0e-10.

The 40 programmes from seed 500 on, of seven pairs of laws, differed by no more than this (`--first 500 --programmes 40`, 7 min of
CPU); all stresses but those of seed 538 by less than 4e-8:

| | worst relative difference |
|---|---|
| stretches | 1.7e-09 |
| stresses, over the largest | 1.0e-07 |
| voltage, over the largest | 1.6e-09 |
| charge, over the largest | 5.9e-09 |
| time of breakdown | 9.1e-10 |
| times of loss of tension | 2.5e-10 |
| time of pull-in | 1.7e-11 |
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from flat import actuate, creep
from programmes import programme

from dielast import FilmStep, Material, Repeat, Spectrum, Step, read_material
from dielast.material.dielectric import Leakage
from dielast.material.shift import NoShift

CYCLE = [
    FilmStep(stretch=3.0, duration=0.25),
    FilmStep(voltage=3e3, duration=0.05),
    FilmStep(stretch=2.0, circuit="open", duration=0.25),
    FilmStep(voltage=0.0, duration=0.05),
]


def balance(cycles: int) -> float:
    """What the table's energies lack over the energy given, of a film with two branches behind a resistance, and leaking."""
    material = Material("m", 3e4, Spectrum(np.array([1.0, 0.05]), np.array([2e4, 5e4])), NoShift(20.0), permittivity=4e-11)
    losses = {"leakage": Leakage(2e-13, 3e7), "resistance": 2e7, "electrode_area": 1e-4}
    ends = [0.6 * cycles]
    history = actuate(material, CYCLE, thickness=1e-3, stop_at="end", repeat=Repeat(cycles), times=ends, rtol=1e-8, **losses)
    tight = actuate(material, CYCLE, thickness=1e-3, stop_at="end", repeat=Repeat(cycles), times=ends, rtol=1e-10, **losses)
    names = ("electrical_energy", "mechanical_work", "dissipated_energy", "leaked_energy", "resistor_energy")
    given = abs(tight.electrical_energy[0, -1]) + tight.mechanical_work[0, -1]
    return max(abs(getattr(history, name)[0, -1] - getattr(tight, name)[0, -1]) for name in names) / given


def timed(cycles: int) -> None:
    """Print the processor time of a generator cycle beside that of a creep test before and after it, and the largest memory."""
    film = {"thickness": 0.5e-3, "prestretch": 2.0, "relax": 600.0, "stop_at": "end"}
    material = read_material("example:vhb4905")
    load = [Step(stress=57e3, duration=17.0), Step.hold(6 * 3600.0)]

    def creeping() -> float:
        return min(seconds(lambda: creep(material, load, mode="uniaxial")) for _ in range(5))

    creeping()
    for count in sorted({max(cycles // 100, 1), max(cycles // 10, 1), cycles}):
        before, begin = creeping(), time.process_time()
        history = actuate(material, CYCLE, repeat=Repeat(count), cycles="last", **film)
        took = (time.process_time() - begin) / count
        alone, memory = 0.5 * (before + creeping()), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        last = history.cycles.electrical_energy[0, -1]
        cost = f"{1e3 * took:.0f} ms a cycle, creep test {1e3 * alone:.0f} ms, ratio {took / alone:.2f}"
        print(f"{count} cycles: {cost}, {memory:.0f} MiB, {last:.9g} J/m^3 in the last", flush=True)


def seconds(job: Callable[[], object]) -> float:
    """The seconds of processor time that a job takes."""
    begin = time.process_time()
    job()
    return time.process_time() - begin


def main() -> None:
    """Print the figures."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in (("programmes", 40), ("balance", 100), ("cycles", 1000)):
        arguments.add_argument(f"--{name}", type=int, default=default)
    arguments.add_argument("--first", type=int, default=0, help="seed of the first programme")
    asked = arguments.parse_args()
    worst: dict[str, float] = {}
    compared, seed = 0, asked.first
    while compared < asked.programmes:
        stated = programme(seed)
        seed += 1
        if stated is None:
            continue
        compared += 1
        found = stated.differences()
        print(f"programme {seed - 1}: " + ", ".join(f"{name} {value:.1e}" for name, value in found.items()), flush=True)
        worst = {name: max(worst.get(name, 0.0), found.get(name, 0.0)) for name in worst | found}
    if worst:
        print(f"worst of {compared} programmes: " + ", ".join(f"{name} {value:.1e}" for name, value in worst.items()))
    if asked.balance:
        print(f"energies of {asked.balance} cycles are within {balance(asked.balance):.1e} of those at a tolerance of 1e-10")
    if asked.cycles:
        timed(asked.cycles)


if __name__ == "__main__":
    main()
