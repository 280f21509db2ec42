"""Copy each figure's plot into the gallery, in few colours so that the repository stays small.

Usage: python gallery.py claims.toml build gallery
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from PIL import Image


def shrink(picture: Path, small: Path) -> None:
    """Write the picture with at most 256 colours."""
    with Image.open(picture) as whole:
        few = whole.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    few.save(small, format="PNG", optimize=True)


if __name__ == "__main__":
    claims, build, gallery = map(Path, sys.argv[1:])
    figures = tomllib.loads(claims.read_text(encoding="utf-8"))["figure"]
    gallery.mkdir(exist_ok=True)
    for figure in figures:
        shrink(build / figure["image"], gallery / f"{figure['name']}.png")
