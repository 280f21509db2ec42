"""Make `dielast/examples/lifetime/failures.csv`, synthetic times to failure: python tests/failures_example.py

Truth: inverse-power damage with a field of 46 MV/m for 1 h, exponent 12, Weibull shape 1.5; 28 films of the example material in a
frame, prestretch 1.9, at four voltages, observed for 6 h. It is not a measurement.
"""

from pathlib import Path

import numpy as np

from dielast.calibration.failures.ageing import Ageing
from dielast.calibration.failures.exposures import Aged
from dielast.calibration.failures.likelihood import Seen
from dielast.calibration.failures.specimens import Specimens, simulate_specimens
from dielast.handover.material_file import read_material
from dielast.simulate.film_setup import Film

FIELD, TIME, EXPONENT, SHAPE = 46e6, 3600.0, 12.0, 1.5
FILM = Film(5e-4, relax=5400.0, boundary="frame", electrode_share=0.0525)
END = 6 * 3600.0
HOME = Path(__file__).resolve().parents[1] / "dielast" / "examples" / "lifetime" / "failures.csv"


def main() -> None:
    voltage = np.repeat([3400.0, 3600.0, 3800.0, 4000.0], 7)
    n = voltage.size
    unknown, empty = np.full(n, np.nan), ("",) * n
    films = Specimens(
        tuple(f"F{k + 1:02d}" for k in range(n)),
        np.full(n, int(Seen.SUSPENDED)),
        np.full(n, END),
        voltage,
        np.full(n, np.inf),
        np.full((n, 2), 1.9),
        np.full(n, 0.5e-3),
        np.full(n, 20.0),
        *(unknown,) * 3,
        *(empty,) * 2,
        np.full(n, -1),
    )
    tested = simulate_specimens(read_material("example:vhb4905.toml"), films, film=FILM)
    aged = Aged.at_rows(tested.histories, Ageing("power", FIELD))
    damage = aged.at(np.array([[EXPONENT]])).y.reshape(tested.histories.time.shape) - np.log(TIME)
    strength = np.log(np.random.default_rng(35).exponential(size=n)) / SHAPE
    rows = ["specimen,voltage [kV],prestretch,time [min],suspended"]
    for k, film in enumerate(tested.film):
        row, time = damage[film], tested.histories.time[film]
        fails = strength[k] < row[-1]
        at = float(np.exp(np.interp(strength[k], row[1:], np.log(time[1:])))) if fails else END
        rows.append(f"{films.name[k]},{voltage[k] / 1e3:g},1.9,{at / 60:.4g},{'no' if fails else 'yes'}")
    HOME.parent.mkdir(exist_ok=True)
    HOME.write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
