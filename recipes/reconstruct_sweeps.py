"""Write frequency sweeps of the reconstructed VHB 4905 as CSV: 15 temperatures, 0.01 to 30 Hz, 1 % noise.

A dynamic mechanical analysis would have measured them; here they are computed from vhb4905-reconstruction.toml.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from dielast import read_material

TEMPERATURES = np.arange(-40.0, 101.0, 10.0)  # degC
FREQUENCY = np.geomspace(0.01, 30.0, 15)  # Hz
NOISE = 0.01

if __name__ == "__main__":
    material = read_material(Path(__file__).with_name("vhb4905-reconstruction.toml"))
    random = np.random.default_rng(1)
    lines = ["temperature [degC],frequency [Hz],storage_modulus [Pa],loss_modulus [Pa]"]
    for temperature in TEMPERATURES:
        reduced = 2 * np.pi * FREQUENCY * 10 ** material.shift.log10_shift_factor(temperature)
        storage = 3 * material.spectrum.storage_modulus(reduced, material.equilibrium_modulus)  # Young's, incompressible
        loss = 3 * material.spectrum.loss_modulus(reduced)
        noise = 1 + NOISE * random.standard_normal((2, FREQUENCY.size))
        rows = zip(FREQUENCY, storage * noise[0], loss * noise[1], strict=True)
        lines += [f"{temperature:g},{f:.6g},{first:.6g},{second:.6g}" for f, first, second in rows]
    sys.stdout.write("\n".join(lines) + "\n")
