"""Raw tests of synthetic laboratories: specimens that differ and go slack, and a machine that rings."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from section import Section, table

sys.path += [str(Path(__file__).resolve().parents[2] / "tests" / each) for each in (".", "bench")]

from bench_raw_tests import FITTED, SCATTER, outcome

LABORATORIES = 6


def raw_tests(data: Path) -> Section:
    """Slack specimens that bear nothing and that push; no measured data."""
    rows, ratios, worse = [], [], []
    named = unnamed = unseen = 0
    for seed in range(LABORATORIES):
        had, pushed = outcome(seed, "bears nothing"), outcome(seed, "pushes")
        ratios.append(had.predicted / had.put_in)
        worse.append(pushed.predicted / had.put_in)
        named += sum(made > 0 and found > 0 for found, made in had.slack)
        unnamed += sum(made > 0 and not found for found, made in had.slack)
        unseen += sum(made > 0 and not left for left, made in had.ringing)
        errors = (had.put_in, had.fitted, had.predicted, pushed.fitted, pushed.predicted)
        rows.append([f"{seed}", *(f"{100 * error:.1f} %" for error in errors)])
    loose = f"{named} of {named + unnamed}"
    fails = f"""
**What fails, and why.** A force that swings by more than 3 % of the largest one is not found in {unseen} tests: the machine
swings at 3 Hz, and their files have three points a second, so that no swing is seen, only a bump after a turn. Such tests need a
higher sampling rate, or `discard`."""
    text = f"""## Raw files: slack specimens and a machine that rings

{LABORATORIES} synthetic laboratories of a material that is known: holds and cycles of specimens whose stress differs by
{100 * SCATTER:g} %, which go slack on the way back, on a machine whose grips swing after each start and stop. {FITTED} tests are
fitted, two of further specimens predicted. *Put in* is what the true material itself misses in these two, at the level of the
specimens that were fitted.

{table(["laboratory", "put in", "fitted", "predicted", "fitted, if slack specimens push", "predicted, if they push"], rows)}

The predicted error is {min(ratios):.2f} to {max(ratios):.2f} times what was put in, {np.median(ratios):.2f} in the middle;
where slack specimens push back in the model, {min(worse):.1f} to {max(worse):.1f} times. Slack is found in {loose} tests that
have it.
{fails if unseen else ""}"""
    return Section(text)
