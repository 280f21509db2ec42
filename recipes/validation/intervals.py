"""How often intervals hold the truth, over synthetic experiments of a known material."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from section import Section, table

from dielast import DielastWarning, RelaxationCurve, build_master_curve, read_material

EXPERIMENTS = 60
TEMPERATURES = np.arange(-40.0, 61.0, 10.0)
REFERENCE = 20.0
NOISE, OFFSET = 0.01, 0.02


def shift_intervals(data: Path) -> Section:
    """95 % intervals of shift factors and of the constants of WLF; no measured data."""
    material = read_material("example:vhb4905")
    time = np.geomspace(1.0, 1000.0, 40)
    truth = material.shift.log10_shift_factor(TEMPERATURES)
    moved = TEMPERATURES != REFERENCE
    rows = []
    for name, offset in (("noise of 1 %", 0.0), (f"and {100 * OFFSET:g} % between specimens", OFFSET)):
        held: dict[str, list[float]] = {"shifts": [], "C1": [], "C2": []}
        for seed in range(EXPERIMENTS):
            rng = np.random.default_rng([71, seed])
            curves = []
            for temperature, log10_shift in zip(TEMPERATURES.tolist(), truth.tolist(), strict=True):
                modulus = 3 * material.spectrum.relaxation_modulus(time / 10**log10_shift, material.equilibrium_modulus)
                level = np.exp(offset * rng.standard_normal())
                curves.append(RelaxationCurve(temperature, time, level * modulus * (1 + NOISE * rng.standard_normal(time.size))))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DielastWarning)
                found = build_master_curve(curves, reference_temperature=REFERENCE)
            score = (found.log10_shift_factor - truth)[moved] / found.log10_shift_factor_stderr[moved]
            held["shifts"].append(float(np.mean(np.abs(score) < 1.96)))
            for key in ("C1", "C2"):
                off = found.law_parameters[key] - getattr(material.shift, key)
                held[key].append(float(abs(off) < 1.96 * found.law_stderr[key]))
        rows.append([name, *(f"{100 * np.mean(values):.0f} %" for values in held.values())])
    text = f"""## How often intervals hold the truth

{EXPERIMENTS} synthetic relaxation tests at {TEMPERATURES.size} temperatures of a material that is known (`example:vhb4905`), \
with noise, and with specimens that differ: the share of 95 % intervals that hold the truth.

{table(["measured with", "log10 a", "C1", "C2"], rows)}

With noise alone the intervals are wider than need be: they also allow for temperatures that are off by 0.3 K and for curves that
are tilted, of which this experiment has none. Bands of measured curves are in the tables above, as the share of points within.
`tests/bench/bench_calibration.py` and `tests/bench/bench_calibrate.py` count the whole chain up to times to failure."""
    return Section(text)
