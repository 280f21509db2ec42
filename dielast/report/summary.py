"""The headline numbers of a run: with units on a terminal, as `section.key = value` in SI units elsewhere."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

# ending of a key -> its unit; the first match counts
UNITS = {
    **{"_V_per_m": "V/m", "_J_per_mol": "J/mol", "_J_per_m3": "J/m³", "_J_per_kg": "J/kg", "_Pa": "Pa", "_degC": "°C"},
    **{"_K": "K", "_V": "V", "_s": "s", "_rad": "rad"},
}
SCALED = ("V/m", "J/mol", "J/m³", "J/kg", "Pa", "V", "s")
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))
LONG = 1e4  # s; longer times are shown in hours
SHOWN = 5  # values of a list
PLAIN = str.maketrans({"°": "deg", "µ": "u", "³": "3", "±": "+-", "…": "..."})


def print_summary(summary: Mapping[str, Any], out: Path) -> None:
    """Print the headline numbers: a table with units on a terminal, `section.key = value` in SI elsewhere."""
    if sys.stdout is not None and sys.stdout.isatty():
        _print_table(summary, out)
    else:
        for section, values in summary_sections(summary):
            for key, value in values.items():
                print(f"{section}.{key} = {_plain(value)}")


def rows(values: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Name and value of each headline number of a section, in a unit that suits its size, beside its standard error."""
    for key, value in values.items():
        if key.endswith("_stderr") and key.removesuffix("_stderr") in values:
            continue
        name, unit = ("in case", "") if key == "cases" and isinstance(value, list) else _split(key)
        yield name, _measured(value, unit, values.get(f"{key}_stderr"))


def summary_sections(summary: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The headline numbers by section, without empty lists."""
    for section, values in summary.items():
        if isinstance(values, Mapping):
            yield section, {key: value for key, value in values.items() if value != []}


def _print_table(summary: Mapping[str, Any], out: Path) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, style="dim")
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for section, values in summary_sections(summary):
        for index, (name, value) in enumerate(rows(values)):
            # Text, so that brackets are not read as markup
            table.add_row(*(Text(_encodable(cell)) for cell in ("" if index else section, name, value)))
    console.print(Text(_encodable(f"{summary['kind']}: results in {out}"), style="bold"), soft_wrap=True)
    console.print(table)


def _split(key: str) -> tuple[str, str]:
    """A key's name without its unit, and the unit."""
    for ending, unit in UNITS.items():
        if key.endswith(ending):
            return key.removesuffix(ending).replace("_", " "), unit
    return key.replace("_", " "), "%" if key.endswith("relative_error") else ""


def _measured(value: Any, unit: str, stderr: float | None = None) -> str:
    if isinstance(value, list):
        more = f", … {len(value)} in all" if len(value) > SHOWN else ""
        return ", ".join(_measured(entry, unit) for entry in value[:SHOWN]) + more
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or (isinstance(value, int) and not unit):
        return _plain(value)
    scale, shown = _scaled(value, unit)
    digits = f"{value / scale:.4g}" if stderr is None else f"{value / scale:.5g} ± {stderr / scale:.2g}"
    return f"{digits} {shown}".rstrip()


def _scaled(value: float, unit: str) -> tuple[float, str]:
    """The divisor of a number for a readable unit, and that unit."""
    if unit == "%":
        return 0.01, unit
    if unit not in SCALED or value == 0:
        return 1.0, unit
    if unit == "s" and abs(value) >= LONG:
        return 3600.0, "h"
    prefixes = [entry for entry in PREFIXES if entry[0] <= 1 or unit != "s"]
    # a number that rounds up to a thousand takes the next prefix
    return next(((factor, sign + unit) for factor, sign in prefixes if abs(value) >= 0.99995 * factor), (1.0, unit))


def _plain(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _encodable(text: str) -> str:
    """The text as this terminal can write it."""
    try:
        text.encode(encoding := sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return text.translate(PLAIN).encode(encoding, "backslashreplace").decode(encoding)
    return text
