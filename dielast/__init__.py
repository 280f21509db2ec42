"""dielast: dielectric elastomers from relaxation measurements to time to failure.

Everything public is imported from here, `from dielast import build_master_curve`, and loaded when it is first used. The names and
their modules are listed in `__init__.pyi`, where type checkers look for them, too.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

_IMPORT = re.compile(r"^from (\S+) import ([^(]+?|\([^)]*\))$", re.MULTILINE)
_NAME = re.compile(r"\w+ as (\w+)")
_LISTED = Path(__file__).with_suffix(".pyi").read_text("utf-8")
_MODULE_OF = {name: module for module, names in _IMPORT.findall(_LISTED) for name in _NAME.findall(names)}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
