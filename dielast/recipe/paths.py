"""Paths of keys as `--set` and sweeps state them, `step.0.rate` or `step[0].rate`: read as TOML reads dotted keys."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Any

from dielast.errors import InputError, shown_path
from dielast.io.toml import DEEPEST

# a part without quotes may hold more than TOML allows here: the message about an unknown key is clearer than one about TOML
_PART = r"""\s*+("(?:[^"\\]|\\.)*+"|'[^']*+'|[^."'=][^.=]*+)\s*+"""
_PATH = rf"{_PART}(?:\.{_PART})*+"
_INDEXED = re.compile(r"(?P<name>[^\[\]]+)(?P<indices>(?:\[\d+\])+)")
_SETTING = re.compile(rf"(?P<path>{_PATH})=(?P<value>.*)", re.DOTALL)


def read_path(text: str) -> tuple[str, ...] | None:
    """The keys of a path; None if the text is not a path."""
    if not re.fullmatch(_PATH, text):
        return None
    try:
        return tuple(key for part in re.findall(_PART, text) for key in _keys_of(part))
    except tomllib.TOMLDecodeError:  # an unknown escape
        return None


def read_setting(text: str) -> tuple[tuple[str, ...], str] | None:
    """The keys and the value of `PATH=VALUE`; None if the text has another form."""
    match = _SETTING.fullmatch(text)
    keys = match and read_path(match["path"])
    return (keys, match["value"].strip()) if match and keys else None


def _keys_of(part: str) -> list[str]:
    """The key of a part, and the indices in brackets after it, as in `step[0]`."""
    if part[0] in "\"'":
        return list(tomllib.loads(f"{part} = 0"))
    indexed = _INDEXED.fullmatch(part.strip())
    return [indexed["name"].strip(), *re.findall(r"\d+", indexed["indices"])] if indexed else [part.strip()]


def set_key(values: dict[str, Any], keys: Sequence[str], value: Any) -> None:
    """Set the key at the path `keys`; raises `InputError` if there is no such place."""
    if len(keys) > DEEPEST:
        raise InputError(f"no key has a path of {len(keys)} parts")
    target: Any = values
    for depth, key in enumerate(keys):
        last = depth == len(keys) - 1
        if isinstance(target, list):
            if not key.isdecimal() or len(key) > 9 or int(key) >= len(target):
                path = shown_path(keys[:depth])
                there = "is empty" if not target else f"has entries 0 to {len(target) - 1}"
                raise InputError(f"{path} {f'has one entry, {path}.0' if len(target) == 1 else there}")
            if last:
                target[int(key)] = value
            target = target[int(key)]
        elif isinstance(target, dict):
            if last:
                target[key] = value
            target = target.setdefault(key, {})
        else:
            raise InputError(f"{shown_path(keys[:depth])} is not a table")
