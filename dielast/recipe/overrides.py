"""Keys that the command line sets, `--set PATH=VALUE`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from dielast.errors import InputError, as_toml, shown_path
from dielast.io.toml import load
from dielast.recipe.file_fields import is_path
from dielast.recipe.paths import read_path, read_setting
from dielast.recipe.validate import Place, field_at


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


def settings(overrides: Sequence[str], model: type[BaseModel]) -> list[str]:
    """The `overrides` of a recipe of `model` in one spelling, absolute paths without their folders, which depend on the machine."""
    stated = [read_override(override) for override in overrides]
    return [f"{shown_path(keys)} = {as_toml(_without_folders(model, keys, value))}" for keys, value in stated]


def _without_folders(model: type[BaseModel], keys: Place, value: Any) -> Any:
    if isinstance(value, list):
        return [_without_folders(model, keys, entry) for entry in value]
    if isinstance(value, dict):
        return {key: _without_folders(model, (*keys, key), entry) for key, entry in value.items()}
    if not isinstance(value, str) or not Path(value).is_absolute():
        return value
    if len(keys) > 1 and keys[0] == "sweep":  # the last key is the path of the swept key
        keys = read_path(str(keys[-1])) or keys
    field = field_at(model, keys)
    return Path(value).name if field is not None and is_path(field) else value
