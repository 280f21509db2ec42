"""Table 1 and Fig. 10: the five spectra side by side.

Usage: python table1.py -o DIR SPECTRUM... (folders written by `dielast spectrum`, cases 1 to 5 in order)
"""

from __future__ import annotations

import argparse
import csv
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dielast.plots.style import COLOURS, MARKERS, legend_below, panels, style
from dielast.plots.texts import log_axis

Array = NDArray[np.float64]


def read_spectrum(folder: Path) -> Array:
    """Relaxation times in s and shear moduli in Pa, shape (branches, 2), slowest first."""
    with (folder / "spectrum.csv").open(newline="", encoding="utf-8") as lines:
        return np.array([[float(cell) for cell in row] for row in list(csv.reader(lines))[1:]])


def plot(spectra: list[Array]) -> Figure:
    with style():
        figure, (axes,) = panels(1, "VHB 4905 (reconstruction), spectra of Table 1, 20 °C", height=3.0)
        for case, spectrum in enumerate(spectra):
            # open markers that shrink from case to case: where spectra coincide, all of them show
            look: Any = {"color": COLOURS[case], "markerfacecolor": "none", "markersize": 7 - case}
            axes.plot(spectrum[:, 0], 1e-6 * spectrum[:, 1], MARKERS[case], label=f"case {case + 1}, N = {len(spectrum)}", **look)
        axes.set_xlabel("relaxation time [s]")
        axes.set_ylabel("shear modulus [MPa]")
        log_axis(axes, "x")
        log_axis(axes, "y")
        legend_below(figure, axes.get_legend_handles_labels()[0])
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("spectra", type=Path, nargs="+")
    options = parser.parse_args()
    spectra = [read_spectrum(folder) for folder in options.spectra]
    # the sums as the runs state them: the CSV rounds each branch
    summaries = [tomllib.loads((folder / "summary.toml").read_text(encoding="utf-8")) for folder in options.spectra]
    totals = [summary["moduli"]["nonequilibrium_shear_Pa"] for summary in summaries]
    table = pd.DataFrame(
        {
            "case": range(1, len(spectra) + 1),
            "branches": [len(spectrum) for spectrum in spectra],
            "relaxation_time_max [s]": [spectrum[0, 0] for spectrum in spectra],
            "relaxation_time_min [s]": [spectrum[-1, 0] for spectrum in spectra],
            "nonequilibrium_shear_modulus [Pa]": totals,
        }
    )
    summary = tomli_w.dumps({"kind": "table", "recipe": Path(__file__).name, "table1": {"cases": len(spectra)}})
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "table1.csv", index=False, float_format="%.9g", lineterminator="\n")
    plot(spectra).savefig(options.out / "table1.png")
    # last, as make takes it for a sign that all is there
    (options.out / "summary.toml").write_text(summary, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
