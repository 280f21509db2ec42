"""Copy each figure's plot into the gallery, in few colours so that the repository stays small.

Usage: python gallery.py claims.toml build gallery
"""

from __future__ import annotations

import io
import sys
import tomllib
from pathlib import Path

from PIL import Image

from dielast.io.files import write_files


def small(picture: Path | io.BytesIO) -> bytes:
    """The picture with at most 256 colours."""
    buffer = io.BytesIO()
    Image.open(picture).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


if __name__ == "__main__":
    claims, build, gallery = map(Path, sys.argv[1:])
    figures = tomllib.loads(claims.read_text(encoding="utf-8"))["figure"]
    write_files(gallery, {f"{figure['name']}.png": small(build / figure["image"]) for figure in figures})
