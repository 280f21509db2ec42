"""Read TOML text; mistakes in it are stated in plain words."""

import codecs
import re
import tomllib
from pathlib import PurePath
from sys import float_info
from typing import Any

from dielast.base.errors import InputError, shown
from dielast.base.units import decimal_comma

DEEPEST = 64  # parts of a dotted key
LARGEST_TOML = 8 << 20  # bytes: a material of 100,000 branches needs half of it
TABLES = (".csv", ".tsv", ".txt", ".dat", ".xls", ".xlsx")
"""Endings of file names of tables, which are not TOML."""
NAMED_IN_RECIPES = "tables are named in a recipe, such as [data] file or [[step]] table"
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*){{{DEEPEST}}}")
_DIGITS = re.compile(r"[0-9A-Fa-f_]{250,}")
_PLACE = re.compile(r" \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)")
_COMMA = re.compile(r"=\s*([+-]?\d+,\d+)\s*(?:[,}#]|$)")
_WORD = re.compile(r"[A-Za-z][\w./-]*")
_QUANTITY = re.compile(r"[+-]?[\d.]+(?:[eE][+-]?\d+)?\s*[A-Za-z%°µμ/][^=\"']*")
_STATED = re.compile(r"\s*(?:(?P<header>\[+\s*(?P<table>[^\[\]]+?)\s*\]+)|(?P<key>[^\s=\[][^=]*?)\s*=)")
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)  # encoding of `dielast new relax > relax.toml` in Windows PowerShell
_OF_ESCAPES = ("unescaped '\\' in a string", "invalid hex value", "escaped character is not a Unicode scalar value")
_LISTED = ("step", "compare")


def parse_toml(content: bytes, source: str, instead: str = NAMED_IN_RECIPES) -> dict[str, Any]:
    """The TOML text `content`; raises `InputError` naming `source` and the line.

    `instead` is the advice for a file that is a table of numbers.
    """
    if len(content) > LARGEST_TOML:
        raise InputError(
            f"larger than {LARGEST_TOML >> 20} MiB, too large for a recipe or a material file; put tables into CSV files",
            file=source,
        )
    hint = f"; {instead}" if PurePath(source).suffix.lower() in TABLES else ""
    try:
        text = content.decode("utf-16" if content.startswith(_UTF_16) else "utf-8-sig")
        values = load(text)
        if _too_large(values):
            raise OverflowError
        return values
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise InputError(f"not UTF-8 text{hint}", file=source, line=line) from None
    except tomllib.TOMLDecodeError as error:
        number, wrong = _explained(text, str(error))
        raise InputError(f"not TOML: {wrong}{hint}", file=source, line=number) from None
    except RecursionError:
        raise InputError("not TOML: nested too deeply", file=source) from None
    except (ValueError, OverflowError):  # ValueError: Python's limit for digits of an integer
        digits = _DIGITS.search(text)
        line = text.count("\n", 0, digits.start() if digits else None) + 1
        raise InputError("not TOML: a number of too many digits", file=source, line=line) from None


def load(text: str) -> dict[str, Any]:
    """The values of a TOML text; raises `ValueError`, or `RecursionError` if it is nested too deeply."""
    if _DEEP_KEY.search(text):  # the parser would use all memory
        raise RecursionError
    return tomllib.loads(text)


def _too_large(value: Any) -> bool:
    """Whether `value` contains an integer beyond the range of floating-point numbers."""
    if isinstance(value, int):
        return abs(value) > float_info.max
    return any(map(_too_large, value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()))


def _explained(text: str, message: str) -> tuple[int, str]:
    """The line (from 1) that the parser stopped at, and its `message`, with a hint for usual mistakes."""
    lines = text.split("\n")
    place = _PLACE.search(message)
    wrong = message[: place.start()] if place else message
    wrong = wrong[0].lower() + wrong[1:]
    if place is None or place["line"] is None:
        number, column = len(lines), len(lines[-1]) + 1
    else:
        number, column = int(place["line"]), int(place["column"])
    line = lines[number - 1][:1000]
    if wrong.startswith(("cannot overwrite a value", "cannot declare ", "duplicate inline table key")):
        return number, _stated_twice(line, wrong)
    before = line[: column - 1]
    start = max(before.rfind(mark) for mark in "=[,") + 1
    value = re.split(r"[,\]}#]", before[start:] + line[column - 1 :])[0].strip()
    hint = ""
    if wrong.startswith(_OF_ESCAPES):
        hint = "in a path write / between folders, or use single quotes"
    elif comma := _COMMA.search(line):
        hint = decimal_comma(comma[1])
    elif wrong == "invalid value" and value.lower() in ("true", "false"):
        hint = f"write {value.lower()}"
    elif wrong == "invalid value" and _WORD.fullmatch(value):
        hint = f"text needs quotes: {shown(value)}"
    elif _opened(line):
        hint = "a quotation mark is missing"
    elif _QUANTITY.fullmatch(value):
        hint = f"a quantity needs quotes: {shown(value)}"
    return number, f"{wrong}; {hint}" if hint else wrong


def _opened(line: str) -> bool:
    """Whether a text in a line is not closed before the line or a comment ends, as far as quotation marks show."""
    rest = re.sub(r"\"[^\"]*\"|'[^']*'", "", line).partition("#")[0]
    return '"""' not in line and any(mark in rest for mark in "\"'")


def _stated_twice(line: str, wrong: str) -> str:
    """The message for a key or a table that is stated twice."""
    if inline := re.search(r"duplicate inline table key '(.*)'", wrong):
        return f"{inline[1]} is stated twice"
    stated = _STATED.match(line)
    hint = f"; write [[{stated['table']}]] each time" if stated and stated["table"] in _LISTED else ""
    return f"{(stated['header'] or stated['key']) if stated else 'a key'} is stated twice{hint}"
