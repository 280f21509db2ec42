"""What benches of synthetic laboratories counted: bands of a voltage, and intervals of constants, that hold the truth.

The benches take hours, and add a line for each laboratory to `counts.jsonl`; these sections are written from its lines.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from section import Section, table

sys.path += [str(Path(__file__).resolve().parents[2] / "tests" / each) for each in (".", "bench")]

from bench_voltage_tests import HIDDEN, MODEL, SPECIMEN, Outcome, outcomes_of, truth
from parts import read

COUNTS = Path(__file__).parent / "counts.jsonl"
KINDS = {"uniaxial": "six uniaxial tests", "films": "and two films under voltage"}


def voltage_tests(data: Path) -> Section:
    """A voltage from uniaxial tests alone, and with two films."""
    found = {what: own for what in KINDS if (own := outcomes_of(COUNTS, what))}
    true, rows, lines = truth(), [], []
    for what, own in found.items():
        for number, each in own.items():
            laws = ", ".join(f"{law} {weight:.2f}" for law, (weight, _, _) in each.laws.items())
            held = "yes" if each.low <= true <= each.high else "no"
            band = f"{1e-3 * each.low:.2f} to {1e-3 * each.high:.2f}"
            rows.append([KINDS[what], f"{number}", laws, f"{1e-3 * each.best:.2f}", band, f"{each.width:.2f}", held])
        lines.append(_in_words(KINDS[what].removeprefix("and ").capitalize(), list(own.values()), true))
    law = HIDDEN.equilibrium_law
    exponent = law.values()["I2_exponent"]
    header = ["tests", "laboratory", "laws with their weights", "best law, kV", "band, kV", "width", "holds"]
    return Section(f"""## The second invariant: a voltage from uniaxial tests

Synthetic laboratories have a material whose springs are `{law.name}`, with a term in the second invariant (exponent {exponent:g});
specimens differ by {100 * SPECIMEN:g} %, and tests are off by {100 * MODEL:g} % along a curve. Six uniaxial tests up to stretch 4
are fitted by five laws; then with two films in frames, at prestretch 2 and 3, whose stretch was measured at voltages. Predicted is
the voltage of a film under dead load for a further stretch of 1.2 at prestretch 3, with a band of 90 %: the true one is
{1e-3 * true:.2f} kV. *Width* is that of the band over the range of the laws and the truth, both as logarithms.
`tests/bench/bench_voltage_tests.py` counts this.

{table(header, rows)}

{chr(10).join(lines)}

**What fails, and why.** In uniaxial tension both invariants grow together, and laws that differ twofold in the voltage of a film
fit alike. No weight of a law, and no average over its undetermined constants, says which of them holds: bands are those that hold
the band of each law in each part of the range of such constants. They are as wide as this ignorance: a prediction of a voltage
from uniaxial tests alone says little more than a factor of two. A voltage test is what ends it.""")


def _in_words(what: str, own: Sequence[Outcome], true: float) -> str:
    held = sum(each.low <= true <= each.high for each in own)
    off = 100 * np.sqrt(np.mean([(each.best / true - 1) ** 2 for each in own]))
    ratio = np.median([each.high / each.low for each in own])
    width = np.median([each.width for each in own])
    return (
        f"- *{what}.* {held} of {len(own)} bands hold the truth. Their ends differ by a factor of {ratio:.2f} in the middle, which "
        f"is {width:.2f} times what the laws require; the best law is off by {off:.0f} %."
    )


def calibrated_intervals(data: Path) -> Section:
    """Intervals of constants: of models that are right, and of models that are off."""
    rows, worst = [], list[tuple[float, str, str]]()
    kinds = {
        "stretch 2": "two specimens to stretch 2, a model 2 % off",
        "stretch 4": "the same to stretch 4",
        "misfit of 0.05": "14 curves at six temperatures, a model 5 % off",
        "misfit of 0.2": "the same, a model 20 % off",
    }
    for key, what in kinds.items():
        every = [each["held"] for each in read(COUNTS, key).values()]
        if not every:
            continue
        # of some, with the verdict before it
        held = [{name: np.atleast_1d(np.array(value, dtype=object))[-1] for name, value in each.items()} for each in every]
        share = {name: np.mean([each[name] for each in held]) for name in held[0]}
        worst += [(float(value), name, what) for name, value in share.items()]
        least = min(share, key=lambda name: share[name])
        rows.append(
            [what, f"{len(every)}", f"{100 * np.mean(list(share.values())):.0f} %", f"`{least}` {100 * share[least]:.0f} %"]
        )
    low = [f"`{name}` ({what}: {100 * value:.0f} %)" for value, name, what in sorted(worst) if value < 0.8]
    fails = f"""

**What fails, and why.** Below 80 % are {", ".join(low)}. The error of a model is not noise: it has one course along all curves of a
kind, and constants that follow this course move together, further than independent errors would move them."""
    return Section(f"""## Intervals of `calibrate`

Synthetic tests of a material that is known, fitted with the settings of `calibrate`: the share of intervals of 90 % that hold the
true constant. `tests/bench/bench_calibrate.py` counts this.

{table(["tests", "laboratories", "all constants", "least"], rows)}{fails if low else ""}""")
