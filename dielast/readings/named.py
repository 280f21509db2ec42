"""What the names of measured files and the text above a table state: temperatures, and the dimensions of a specimen."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.base.units import LENGTH, TEMPERATURE, ZERO_CELSIUS, conversion, converts
from dielast.readings.recipe import MeasuredData
from dielast.readings.seen import SeenTable

_LENGTHS = {
    "gauge_length": r"gau?ge[ _-]length|messl[äa]nge|einspannl[äa]nge|\bL_?0\b",
    "width": r"\bwidth|\bbreite|\bb_?0\b",
    "thickness": r"\bthickness|\bdicke|\ba_?0\b",
}


def specimen_above(seen: SeenTable) -> dict[str, tuple[str, str]]:
    """The dimensions of the specimen that the text above a table states with their unit, and the line that states each."""
    found = {}
    for key, words in _LENGTHS.items():
        pattern = re.compile(
            rf"(?:{words})(?P<between>[^\d\n]*?)(?P<number>\d+(?:[.,]\d+)?)[\s;,\t\"]*(?P<unit>[A-Za-zµμ]*)", re.IGNORECASE
        )
        for line in seen.above.split("\n"):
            match = pattern.search(line[:300])
            if match is None:
                continue
            inside = re.search(r"[\[(/]\s*([A-Za-zµμ]+)", match["between"])
            unit = next((text for text in (match["unit"], inside[1] if inside else "") if text and converts(text, LENGTH)), None)
            if unit is not None:
                found[key] = (f"{match['number'].replace(',', '.')} {unit}", " ".join(line.split()))
                break
    return found


_IN_NAME = re.compile(r"(?P<dash>-*)(?P<number>\d+(?:\.\d+)?)\s?_?(?P<unit>(?:deg|°)\s?[CF]|[CFK])(?![A-Za-z0-9])")


@dataclass(frozen=True, slots=True)
class NamedTemperatures:
    """Temperatures in the names of files: quantities with their unit, a `pattern` of the names for a recipe (None if they also
    differ elsewhere), and why they are doubtful (empty if they are not); `quantities` are then what stands in the names.
    """

    quantities: tuple[str, ...]
    pattern: str | None
    doubt: str = ""


def temperatures_in_names(names: Sequence[str]) -> NamedTemperatures | None:
    """The temperatures that the names of files state, such as `dma_20C.csv`; None if they state none.

    A dash between a word and the number is a sign or a separator: it is doubtful unless one of the names shows which.
    """
    matches = [_IN_NAME.search(name) for name in names]
    if any(match is None for match in matches):
        return _numbers_in_names(names)
    found = [match for match in matches if match is not None]
    glued = [
        len(match["dash"]) for match, name in zip(found, names, strict=True) if match.start() and name[match.start() - 1].isalnum()
    ]
    parts = all(glued) and len(glued) == len(names) and max(glued) > 1  # a--20C beside a-20C: the first dash separates
    signs = [match["dash"][1:] if parts else match["dash"] for match in found]
    units = ["degF" if "F" in match["unit"] else "K" if match["unit"] == "K" else "degC" for match in found]
    quantities = tuple(f"{sign}{match['number']} {unit}" for sign, match, unit in zip(signs, found, units, strict=True))
    ends = [
        (name[: match.start("number") - len(sign)], name[match.end("number") :])
        for name, match, sign in zip(names, found, signs, strict=True)
    ]
    unit = units[0]
    pattern = f"{ends[0][0]}{{{unit}}}{ends[0][1]}" if len(set(ends)) == 1 and unit in ("degC", "K") else None
    doubt = ""
    if not parts and any(glued) and any(float(match["number"]) for match in found):
        doubt = "a dash before the number is a sign or a separator"
    return NamedTemperatures(quantities, pattern, doubt)


def _numbers_in_names(names: Sequence[str]) -> NamedTemperatures | None:
    """Numbers without a unit, the only part in which the names of several files differ."""
    cut = [re.split(r"(\d+(?:\.\d+)?)", name) for name in names]
    if len(names) < 2 or len({len(parts) for parts in cut}) > 1:
        return None
    differing = [k for k in range(len(cut[0])) if len({parts[k] for parts in cut}) > 1]
    if len(differing) != 1 or not differing[0] % 2:
        return None
    numbers = tuple(parts[differing[0]] for parts in cut)
    return NamedTemperatures(numbers, None, "the names state a number without a unit")


TOLERANCE = float(MeasuredData.model_fields["temperature_tolerance"].default)  # K


def levels_of(celsius: NDArray[np.float64]) -> list[float]:
    """The temperatures in degC that readings (n,) further apart than the `TOLERANCE` show, ascending, each as their mean."""
    values = np.sort(celsius[np.isfinite(celsius)])
    if not values.size:
        return []
    sets = np.split(values, np.flatnonzero(np.diff(values) > TOLERANCE) + 1)
    return [round(float(np.mean(readings)), 6) + 0.0 for readings in sets]


def celsius(quantity: str) -> float:
    """A temperature with its unit, such as "293 K", in degC, rounded against the errors of its conversion."""
    number, _, unit = quantity.partition(" ")
    scale, offset = conversion(unit, TEMPERATURE)
    return max(round(float(number) * scale + offset, 6), -ZERO_CELSIUS)
