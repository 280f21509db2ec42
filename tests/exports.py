"""Exports written for tests in the layouts of instruments' software; the numbers are those of a model material.

`python tests/exports.py` writes the files in `tests/instruments`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dielast import WLF

FOLDER = Path(__file__).parent / "instruments"
LAW = WLF(20.0, 8.0, 90.0)
TEMPERATURES = (0.0, 20.0, 40.0)
OMEGA = np.geomspace(0.1, 100.0, 13)
TIME = np.geomspace(1.0, 300.0, 12)
_TAU = np.geomspace(1e-5, 1e4, 28)
_MODULI = 1e6 / (1 + (_TAU / 1e-4) ** 0.5)
SHEAR_EQUILIBRIUM = 2e5


@dataclass(frozen=True)
class Step:
    """One step of an export: name, columns and their units, rows of numbers."""

    name: str
    names: Sequence[str]
    units: Sequence[str]
    rows: Sequence[Sequence[float]]


def sweep(temperature: float) -> np.ndarray:
    """Angular frequency in rad/s, storage and loss shear modulus in Pa at a temperature in degC, shape (n, 3)."""
    reduced = np.outer(OMEGA * 10 ** float(LAW.log10_shift_factor(temperature)), _TAU)
    storage = SHEAR_EQUILIBRIUM + (reduced**2 / (1 + reduced**2)) @ _MODULI
    loss = (reduced / (1 + reduced**2)) @ _MODULI
    return _rounded(np.column_stack((OMEGA, storage, loss)))


def relaxation(temperature: float) -> np.ndarray:
    """Time in s and shear relaxation modulus in Pa, shape (n, 2)."""
    reduced = np.outer(TIME / 10 ** float(LAW.log10_shift_factor(temperature)), 1 / _TAU)
    return _rounded(np.column_stack((TIME, SHEAR_EQUILIBRIUM + np.exp(-reduced) @ _MODULI)))


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.vectorize(lambda value: float(f"{value:.7g}"))(values)


def number(value: float, decimal: str = ".") -> str:
    """A number as it is printed, with this decimal mark."""
    return repr(float(value)).replace(".", decimal)


def _lines(rows: Sequence[Sequence[str]], separator: str) -> list[str]:
    return [separator.join(f'"{cell}"' if separator in cell else cell for cell in row) for row in rows]


def _numbers(step: Step, decimal: str) -> list[list[str]]:
    return [[number(value, decimal) for value in row] for row in step.rows]


def trios(steps: Sequence[Step], separator: str = "\t", decimal: str = ".", instrument: str = "Discovery HR 20") -> str:
    """TRIOS's plain text and CSV export."""
    head = [["Filename", "model"], ["Operator", "Nobody"], ["[File Parameters]"], ["Instrument type", instrument]]
    head += [["Trios version", "5.1"], ["[Geometry Parameters]"], ["Diameter", "25.0 mm"]]
    for step in steps:
        head += [["[step]"], [step.name], list(step.names), list(step.units), *_numbers(step, decimal), [""]]
    return "\n".join(_lines(head, separator)) + "\n"


def trios_lims(steps: Sequence[Step], decimal: str = ".", instrument: str = "AresG2") -> str:
    """TRIOS's export to LIMS."""
    rows = [["[Version]"], ["TA Instruments LIMS export format version", "0"], ["[Parameters: File Parameters]"]]
    rows += [["Instrument type", instrument], ["Trios version", "5.1"]]
    for step in steps:
        rows += [["[Step]"], ["Step name", step.name], ["Number of points", str(len(step.rows))]]
        rows += [["Variables", *step.names], ["Units", *step.units]]
        rows += [["Data point", *row] for row in _numbers(step, decimal)]
    return "\n".join(_lines(rows, "\t")) + "\n"


def rheocompass(steps: Sequence[Step], separator: str = "\t", decimal: str = ".") -> str:
    """RheoCompass, every step a result with one interval."""
    rows = [["Project:", "model"], ["Test:", "test 1"]]
    for step in steps:
        rows += [["Result:", step.name], [""], ["Interval and data points:", "1", str(len(step.rows))]]
        rows += [["Interval data:", "Point No.", *step.names], [""] * (len(step.names) + 2)]
        rows += [["", "", *(f"[{unit}]" for unit in step.units)]]
        rows += [["", str(place), *row] for place, row in enumerate(_numbers(step, decimal), start=1)] + [[""]]
    return "\r\n".join(_lines(rows, separator)) + "\r\n"


def rheoplus(steps: Sequence[Step], decimal: str = ".") -> str:
    """Rheoplus, one data series with an interval for every step."""
    rows = [["Data Series Information"], [""], ["Name:", "", "", "model"], ["Number of Intervals:", "", "", str(len(steps))]]
    for place, step in enumerate(steps, start=1):
        rows += [["Interval:", "", "", str(place)], ["Number of Data Points:", "", "", str(len(step.rows))], [""]]
        rows += [["Meas. Pts.", *step.names], ["", *(f"[{unit}]" for unit in step.units)]]
        rows += [[str(k), *row] for k, row in enumerate(_numbers(step, decimal), start=1)] + [[""]]
    return "\r\n".join(_lines(rows, "\t")) + "\r\n"


def universal_analysis(steps: Sequence[Step], decimal: str = ".") -> str:
    """Universal Analysis: the columns of all steps are the same, a row of -1 ends a step."""
    first = steps[0]
    rows = [["Version", "V4.5A"], ["Nsig", str(len(first.names))]]
    rows += [[f"Sig{k}", f"{name} ({unit})"] for k, (name, unit) in enumerate(zip(first.names, first.units, strict=True), start=1)]
    rows += [["OrgFile", "C:\\model.001"], ["StartOfData"]]
    for step in steps:
        rows += [*_numbers(step, decimal), ["-1"] + ["0"] * (len(first.names) - 1)]
    return "\r\n".join(_lines(rows, "\t")) + "\r\n"


def rheology_advantage(steps: Sequence[Step], decimal: str = ".") -> str:
    """Rheology Advantage: a title, names and units above every step."""
    rows = [["Geometry", "40 mm plate"], [""]]
    for step in steps:
        rows += [[step.name], list(step.names), list(step.units), *_numbers(step, decimal), [""]]
    return "\r\n".join(_lines(rows, "\t")) + "\r\n"


def proteus(steps: Sequence[Step], separator: str = ";", decimal: str = ",") -> str:
    """Proteus: one table; the first step only."""
    step = steps[0]
    words = {";": "SEMICOLON", "\t": "TAB", ",": "COMMA"}
    head = [f"#EXPORTTYPE:{separator}DATA ALL", f"#FORMAT:{separator}NETZSCH5", f"#IDENTITY:{separator}{step.name}"]
    head += [f"#DECIMAL:{separator}{'COMMA' if decimal == ',' else 'POINT'}", f"#SEPARATOR:{separator}{words[separator]}"]
    head += [f"#MTYPE:{separator}DMA", f"#RANGE:{separator}0,0°C/40,0°C", ""]
    head += ["##" + separator.join(f"{name}/{unit}" if unit else name for name, unit in zip(step.names, step.units, strict=True))]
    return "\r\n".join(head + _lines(_numbers(step, decimal), separator)) + "\r\n"


def eplexor(steps: Sequence[Step], separator: str = "\t", decimal: str = ",") -> str:
    """Eplexor: one table; the first step only."""
    step = steps[0]
    rows = [["NETZSCH GABO Eplexor 500 N"], ["Probe", "Modell"], [""], list(step.names), list(step.units)]
    return "\r\n".join(_lines(rows + _numbers(step, decimal), separator)) + "\r\n"


def sweeps(names: Sequence[str], units: Sequence[str], temperatures: Sequence[float] = TEMPERATURES) -> list[Step]:
    """A frequency sweep with columns temperature, angular frequency (high to low), storage and loss modulus at each temperature."""
    return [
        Step(
            f"Frequency sweep ({temperature:.1f} °C)",
            names,
            units,
            [[temperature + 0.03 * (-1) ** k, *row] for k, row in enumerate(sweep(temperature)[::-1].tolist())],
        )
        for temperature in temperatures
    ]


def relaxations(names: Sequence[str], units: Sequence[str], temperatures: Sequence[float] = TEMPERATURES) -> list[Step]:
    """A relaxation test with columns temperature, time and relaxation modulus at each temperature."""
    return [
        Step(
            f"Stress relaxation ({temperature:.1f} °C)",
            names,
            units,
            [[temperature, *row] for row in relaxation(temperature).tolist()],
        )
        for temperature in temperatures
    ]


def _dma() -> Step:
    """All sweeps below one another, Young's moduli in MPa over Hz, as a DMA writes them."""
    rows = [
        [row[0], *_rounded(np.array([row[1] / (2 * np.pi), 3e-6 * row[2], 3e-6 * row[3]]))]
        for step in sweeps((), ())
        for row in step.rows
    ]
    return Step("model", (), (), rows)


def files() -> dict[str, bytes]:
    """The files in `tests/instruments` by name."""
    usual = ("Temperature", "Angular frequency", "Storage modulus", "Loss modulus"), ("°C", "rad/s", "Pa", "Pa")
    condition = Step("Conditioning", ("Temperature", "Step time"), ("°C", "s"), [])
    amplitude = Step("Amplitude sweep", *usual, [[20.0, 10.0, 5e5, 1e5 + k] for k in range(5)])
    german = ("Temperatur", "Kreisfrequenz", "Speichermodul", "Verlustmodul"), ("°C", "rad/s", "Pa", "Pa")
    short = ("temperature", "ang. frequency", "G'", 'G"', "osc. stress"), ("°C", "rad/s", "Pa", "Pa", "Pa")
    dma = _dma()
    ua = [
        Step("", ("Time", "Temperature", "Frequency", "Storage Modulus", "Loss Modulus"), ("min", "°C", "Hz", "MPa", "MPa"), rows)
        for rows in (
            [[0.1 * k, *row] for k, row in enumerate(dma.rows[start : start + OMEGA.size], start=1)] for start in (0, 13, 26)
        )
    ]
    wide = [
        [temperature, 10.0 * k, *_rounded(3e-6 * sweep(temperature)[::4, 1:]).ravel()] for k, temperature in enumerate(TEMPERATURES)
    ]
    at = [f"{omega / (2 * np.pi):.6f} Hz" for omega in OMEGA[::4]]
    many = Step(
        "model",
        ["Temp.", "Time", *(f"{name}({frequency})" for frequency in at for name in ("E'", "E''"))],
        ["°C", "min", *["MPa"] * (2 * len(at))],
        wide,
    )
    relaxing = ("Temperature", "Step time", "Relaxation modulus"), ("°C", "s", "Pa")
    spread = [Step(step.name, short[0], short[1], [[*row, 100.0] for row in step.rows]) for step in sweeps(*usual)]
    return {
        "trios-sweeps.txt": trios([condition, amplitude, *sweeps(*usual)]).encode("utf-8-sig"),
        "trios-lims-sweeps.txt": trios_lims([*sweeps(*usual)]).encode(),
        "trios-relaxation.csv": trios(relaxations(*relaxing), ",").encode(),
        "rheocompass-sweeps.csv": rheocompass(sweeps(*usual)).encode("utf-16"),
        "rheocompass-german.csv": rheocompass(sweeps(*german), ";", ",").encode("latin-1"),
        "rheocompass-relaxation.csv": rheocompass(
            relaxations(("Temperature", "Interval Time", "Relaxation Modulus"), ("°C", "s", "Pa"))
        ).encode("utf-16"),
        "rheoplus-sweeps.txt": rheoplus(
            sweeps(("Temperature", "Angular Frequency", "Storage Modulus", "Loss Modulus"), ("°C", "1/s", "Pa", "Pa"))
        ).encode("latin-1"),
        "universal-analysis-sweeps.txt": universal_analysis(ua).encode("utf-16"),
        "rheology-advantage-sweeps.txt": rheology_advantage(spread).encode("latin-1"),
        "proteus-sweeps.csv": proteus([Step("model", ("Temp.", "f", "E'", "E''"), ("°C", "Hz", "MPa", "MPa"), dma.rows)]).encode(
            "latin-1"
        ),
        "proteus-frequencies.txt": proteus([many], "\t", ".").encode("latin-1"),
        "eplexor-sweeps.txt": eplexor([Step("", ("T", "f", "E'", "E''"), ("°C", "Hz", "MPa", "MPa"), dma.rows)]).encode("latin-1"),
    }


LAYOUTS: dict[str, Callable[..., str]] = {
    "TA Instruments TRIOS": trios,
    "Anton Paar RheoCompass": rheocompass,
    "Anton Paar Rheoplus": rheoplus,
    "TA Instruments Universal Analysis": universal_analysis,
    "TA Instruments Rheology Advantage": rheology_advantage,
    "Netzsch Proteus": proteus,
    "Gabo Eplexor": eplexor,
}


if __name__ == "__main__":
    for name, content in files().items():
        (FOLDER / name).write_bytes(content)
