"""TOML text read, and what is wrong with it said in plain words."""

from __future__ import annotations

import re
import tomllib
from pathlib import PurePath
from sys import float_info
from typing import Any

from dielast.errors import InputError, shown
from dielast.recipe.paths import DEEPEST
from dielast.units import decimal_comma

LARGEST_TOML = 8 << 20  # bytes: a material of 100,000 branches needs half of it
TABLES = (".csv", ".tsv", ".txt", ".dat", ".xls", ".xlsx")
"""How the names of tables end, which are no TOML."""
NAMED_IN_RECIPES = "tables are named in a recipe, such as [data] file or [[step]] table"
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*){{{DEEPEST}}}")
_DIGITS = re.compile(r"[0-9A-Fa-f_]{250,}")
_PLACE = re.compile(r" \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)")
_COMMA = re.compile(r"=\s*([+-]?\d+,\d+)\s*(?:[,}#]|$)")
_WORD = re.compile(r"[A-Za-z][\w./-]*")
_QUANTITY = re.compile(r"[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*[A-Za-z%°µμ/][^=\"']*")
_STATED = re.compile(r"\s*(?:(?P<header>\[+\s*(?P<table>[^\[\]]+?)\s*\]+)|(?P<key>[^\s=\[][^=]*?)\s*=)")
_LISTED = ("step", "compare")


def parse_toml(content: bytes, source: str, instead: str = NAMED_IN_RECIPES) -> dict[str, Any]:
    """The TOML text `content`; raises `InputError` naming `source` and the line.

    `instead` says what is to be done with a table of numbers.
    """
    if len(content) > LARGEST_TOML:
        raise InputError(
            f"larger than {LARGEST_TOML >> 20} MiB: recipes and material files are not; tables go into CSV", file=source
        )
    hint = f"; {instead}" if PurePath(source).suffix.lower() in TABLES else ""
    try:
        text = content.decode("utf-8-sig")
        values = load(text)
        if _too_large(values):
            raise OverflowError
        return values
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise InputError(f"not UTF-8 text{hint}", file=source, line=line) from None
    except tomllib.TOMLDecodeError as error:
        number, what = _told(text, str(error))
        raise InputError(f"not TOML: {what}{hint}", file=source, line=number) from None
    except RecursionError:
        raise InputError("not TOML: nested too deeply", file=source) from None
    except (ValueError, OverflowError):  # ValueError is Python's own limit
        digits = _DIGITS.search(text)
        line = text.count("\n", 0, digits.start() if digits else None) + 1
        raise InputError("not TOML: a number of too many digits", file=source, line=line) from None


def load(text: str) -> dict[str, Any]:
    """The values of a TOML text; raises `ValueError`, or `RecursionError` if it is nested too deeply."""
    if _DEEP_KEY.search(text):  # which takes the parser memory without end
        raise RecursionError
    return tomllib.loads(text)


def _too_large(value: Any) -> bool:
    """Whether there is an integer in `value` that no floating-point number comes near."""
    if isinstance(value, int):
        return abs(value) > float_info.max
    return any(map(_too_large, value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()))


def _told(text: str, said: str) -> tuple[int, str]:
    """The line (from 1) that the parser stopped at, and what it said, with a hint where a usual mistake is plain."""
    lines = text.split("\n")
    place = _PLACE.search(said)
    what = said[: place.start()] if place else said
    what = what[0].lower() + what[1:]
    if place is None or place["line"] is None:
        number, column = text.count("\n") + 1, len(lines[-1]) + 1
    else:
        number, column = int(place["line"]), int(place["column"])
    line = lines[number - 1][:1000]
    if what.startswith(("cannot overwrite a value", "cannot declare ", "duplicate inline table key")):
        return number, _stated_twice(line, what)
    before = line[: column - 1]
    start = max(before.rfind(mark) for mark in "=[,") + 1
    value = re.split(r"[,\]}#]", before[start:] + line[column - 1 :])[0].strip()
    if comma := _COMMA.search(line):
        return number, f"{what}; {decimal_comma(comma[1])}"
    if what == "invalid value" and value.lower() in ("true", "false"):
        return number, f"{what}; write {value.lower()}"
    if what == "invalid value" and _WORD.fullmatch(value):
        return number, f"{what}; text needs quotes: {shown(value)}"
    if _QUANTITY.fullmatch(value):
        return number, f"{what}; a quantity needs quotes: {shown(value)}"
    return number, what


def _stated_twice(line: str, what: str) -> str:
    """What is said of a key or a table that is there already."""
    if inline := re.search(r"duplicate inline table key '(.*)'", what):
        return f"{inline[1]} is stated twice"
    found = _STATED.match(line)
    hint = f"; write [[{found['table']}]] each time" if found and found["table"] in _LISTED else ""
    return f"{(found['header'] or found['key']) if found else 'a key'} is stated twice{hint}"
