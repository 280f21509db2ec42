"""The photographs that ship with dielast: the electrode of a simulated film, rendered. `make examples` runs this.

render_photographs.py ACTUATE.csv FOLDER: a photograph every 8 s of the columns `time [s]` and `relative_stretch_1 [1]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from photographs import Scene, render, saved

from dielast.io.table import number_columns

INTERVAL, COUNT, DIAMETER = 8.0, 12, 64.0  # s, photographs, px


def main() -> None:
    table, folder = Path(sys.argv[1]), Path(sys.argv[2])
    time, stretch = number_columns(table.read_bytes(), str(table), ["time [s]", "relative_stretch_1 [1]"])
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(COUNT):
        axis = DIAMETER * float(np.interp(INTERVAL * number, time, stretch))
        scene = Scene((112, 112), (55.3, 56.1), (axis, axis), strips=(90.0, 270.0), light=0.3, blur=0.8, noise=0.02, seed=number)
        (folder / f"photo-{number:03}.png").write_bytes(saved(render(scene)))


if __name__ == "__main__":
    main()
