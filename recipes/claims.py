"""What the paper states beside what came out: writes README.md from claims.toml and the results of the recipes.

Usage: python claims.py claims.toml build                      print the page
       python claims.py claims.toml build --compare README.md  print where a page differs in its numbers, then exit 1

A number may differ by one in its last digit, as it may between machines. A claim that has no `differs` must agree, and one that
has a `differs` must not: a page cannot be written that says otherwise.
"""

from __future__ import annotations

import argparse
import csv
import math
import re
import sys
import tomllib
from collections.abc import Callable, Sequence
from decimal import Decimal
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

Row = dict[str, str]
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


class Results:
    """The folders that the recipes wrote, each file read once."""

    def __init__(self, folder: Path) -> None:
        self.summary: Callable[[str], Any] = cache(
            lambda name: tomllib.loads((folder / name / "summary.toml").read_text(encoding="utf-8"))
        )
        self.table: Callable[[str], list[Row]] = cache(
            lambda name: list(csv.DictReader((folder / name).read_text(encoding="utf-8").splitlines()))
        )

    def find(self, where: dict[str, Any]) -> list[float]:
        """The numbers that a claim's `find` speaks of: a summary's, a column's, or a spread, a straightness or a ratio of such."""
        measures = {
            "summary": self._summary,
            "column": self._column,
            "spread": self._spread,
            "straightness": self._straightness,
            "ratio": self._ratio,
        }
        values = next(measures[key] for key in measures if key in where)(where)
        if "take" in where:
            values = [values[-1] if where["take"] == "last" else {"min": min, "max": max}[where["take"]](values)]
        return [value * where.get("scale", 1.0) for value in values]

    def _summary(self, where: dict[str, Any]) -> list[float]:
        """A number of a summary, or a list of them."""
        value = self.summary(where["summary"])
        for key in where["key"].split("."):
            value = value[key]
        return [float(entry) for entry in (value if isinstance(value, list) else [value])]

    def _column(self, where: dict[str, Any]) -> list[float]:
        """A column of a table, in the rows that have these values."""
        chosen = where.get("rows", {})
        rows = [row for row in self.table(where["table"]) if all(_same(row[key], value) for key, value in chosen.items())]
        return [float(row[where["column"]]) for row in rows]

    def _spread(self, where: dict[str, Any]) -> list[float]:
        """The largest relative distance of some cases' columns from another case's, at equal times."""
        series: dict[int, dict[str, float]] = {}
        for row in self.table(where["table"]):
            series.setdefault(int(row["case"]), {})[row["time [s]"]] = float(row[where["spread"]])
        reference = series[where["from"]]
        return [max(abs(series[case][time] / value - 1) for case in where["of"] for time, value in reference.items())]

    def _straightness(self, where: dict[str, Any]) -> list[float]:
        """R squared of the straight line of a column over log time, from some time on."""
        rows = [row for row in self.table(where["table"]) if float(row["time [s]"]) >= where["since"]]
        x = [math.log10(float(row["time [s]"])) for row in rows]
        y = [float(row[where["straightness"]]) for row in rows]
        mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
        xy = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True))
        return [xy**2 / sum((a - mean_x) ** 2 for a in x) / sum((b - mean_y) ** 2 for b in y)]

    def _ratio(self, where: dict[str, Any]) -> list[float]:
        """The numbers of one `find` over those of another, pair by pair."""
        above, below = (self.find(part) for part in where["ratio"])
        return [a / b for a, b in zip(above, below, strict=True)]


def _same(text: str, value: float | str) -> bool:
    return text == value if isinstance(value, str) else math.isclose(float(text), value, rel_tol=1e-6)


def judge(claim: dict[str, Any], values: Sequence[float]) -> tuple[str, str]:
    """(verdict, remark) of a claim; raises `SystemExit` where the verdict is not the one that the claim expects."""
    if "incomparable" in claim:
        return "not comparable", claim["incomparable"]
    remark = ""
    if "expected" in claim:
        (value,) = values
        off = value / claim["expected"] - 1
        agrees = abs(off) <= claim["tolerance"]
        remark = f"{100 * off:+.1f} %" if abs(off) >= 5e-4 else ""
    else:
        agrees = all(claim.get("least", -math.inf) <= value <= claim.get("most", math.inf) for value in values)
    if agrees == ("differs" in claim):
        shown = ", ".join(f"{value:g}" for value in values)
        raise SystemExit(f'claims.toml: "{claim["paper"]}": {shown} {"agrees" if agrees else "differs"}, the claim says otherwise')
    return ("agrees", remark) if agrees else ("differs", ": ".join(filter(None, [remark, claim["differs"]])))


def section(figure: dict[str, Any], results: Results) -> tuple[list[str], list[str]]:
    """The lines of a figure, and its verdicts."""
    sources = ", ".join(f"[{name}]({name})" for name in figure["sources"])
    picture = f"![{figure['alt']}](gallery/{figure['name']}.png)"
    lines = [f"## {figure['title']}", "", picture, "", f"*{sources}.* {figure['text']}".strip()]
    verdicts = []
    if "claim" in figure:
        lines += ["", "| the paper | dielast | verdict |", "|---|---|---|"]
    for claim in figure.get("claim", []):
        values = results.find(claim["find"])
        verdict, remark = judge(claim, values)
        verdicts.append(verdict)
        mark = " †" if claim.get("put_in") else ""
        shown = claim["dielast"].format(*values)
        lines.append(f"| {claim['paper']}{mark} | {shown} | **{verdict}**{', ' if remark else ''}{remark} |")
    return lines, verdicts


def page(claims: Path, folder: Path) -> str:
    """The whole page."""
    text = tomllib.loads(claims.read_text(encoding="utf-8"))
    results = Results(folder)
    sections, overview = [], []
    counts = {"agrees": 0, "differs": 0, "not comparable": 0}
    for figure in text["figure"]:
        lines, verdicts = section(figure, results)
        sections.append("\n".join(lines))
        for verdict in verdicts:
            counts[verdict] += 1
        if verdicts:
            anchor = re.sub(r"[^\w\- ]", "", figure["title"].lower()).replace(" ", "-")
            told = ", ".join(f"{verdicts.count(verdict)} {verdict.rstrip('s')}" for verdict in counts if verdict in verdicts)
            overview.append(f"- [{figure['title']}](#{anchor}): {told}")
    total = (
        f"Of {sum(counts.values())} statements of the paper, {counts['agrees']} agree, {counts['differs']} differ for the reason "
        f"given, and {counts['not comparable']} cannot be compared."
    )
    return "\n\n".join([text["head"].strip(), f"{total}\n\n" + "\n".join(overview), *sections, text["foot"].strip()]) + "\n"


def differences(now: str, then: str) -> list[str]:
    """Lines of two pages that differ by more than one in the last digit of a number."""
    lines = []
    for new, old in zip_longest(now.splitlines(), then.splitlines(), fillvalue=""):
        numbers = [(Decimal(a), Decimal(b)) for a, b in zip(NUMBER.findall(new), NUMBER.findall(old), strict=False)]
        close = all(abs(a - b) <= Decimal(1).scaleb(int(b.as_tuple().exponent)) for a, b in numbers)
        if NUMBER.sub("#", new) != NUMBER.sub("#", old) or not close:
            lines += [f"- {old}", f"+ {new}"]
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("claims", type=Path)
    parser.add_argument("results", type=Path)
    parser.add_argument("--compare", type=Path)
    options = parser.parse_args()
    text = page(options.claims, options.results)
    if options.compare is None:
        sys.stdout.buffer.write(text.encode())
        return 0
    lines = differences(text, options.compare.read_text(encoding="utf-8"))
    for line in lines:
        print(f"{options.compare.name}: {line}", file=sys.stderr)
    if lines:
        print(f"{options.compare.name}: not what the recipes give now; `make README.md` writes it anew", file=sys.stderr)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
