"""Paths of keys as `--set` and sweeps state them, `step.0.rate` or `step[0].rate`: read as TOML reads dotted keys."""

import os
import re
import tomllib
from collections.abc import Sequence
from typing import Any

from dielast.base.errors import InputError, shown_path
from dielast.io.toml import DEEPEST, load

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
        return tuple(key for part in re.findall(_PART, text) for key in _keys_in(part))
    except tomllib.TOMLDecodeError:  # an unknown escape
        return None


def keys_of(text: str) -> tuple[str, ...]:
    """The keys of a path; text that is not a path is a key."""
    return read_path(text) or (text,)


def read_setting(text: str) -> tuple[tuple[str, ...], str] | None:
    """The keys and the value of `PATH=VALUE`; None if the text has another form."""
    match = _SETTING.fullmatch(text)
    keys = match and read_path(match["path"])
    return (keys, match["value"].strip()) if match and keys else None


def read_override(override: str) -> tuple[tuple[str, ...], Any]:
    """The path of keys and the value of `PATH=VALUE`; a VALUE that is not TOML is text. Raises `InputError`."""
    try:
        # bytes that the locale could not decode are read as UTF-8
        override = os.fsencode(override).decode()
    except UnicodeDecodeError:
        raise InputError("not UTF-8 text", key=f"--set {override!a}") from None
    setting = read_setting(override)
    if setting is None:
        raise InputError("PATH=VALUE is needed, such as fit.branches=20", key=f"--set {override}")
    keys, text = setting
    try:
        return keys, load(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return keys, text


def _keys_in(part: str) -> list[str]:
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
