"""Every golden recipe gives its expected tables and summary, through the comparison that `--golden` makes.

A folder here holds `recipe.toml` and, in `expected`, what it gave when last looked at; `pytest --update-golden` refreshes them.
Where `expected` holds a `plot.png`, the plot is compared as well: small, and blurred by that, as text is set a little differently
from one version of a font library to the next.
"""

from __future__ import annotations

import io
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.io.files import write_files
from dielast.report.golden import differences
from dielast.sharing.execution import Execution

HERE = Path(__file__).resolve().parent
RTOL = 1e-6  # where rounding or a fit amplifies it, a folder's tolerance.toml says so
NAMES = sorted(path.parent.name for path in HERE.glob("*/recipe.toml"))
PLOT = "plot.png"
WIDTH = 400  # pixels
DIFFERENCE = 6.0  # root mean square of grey levels, of 255; a line that is missing makes more


def small(plot: bytes) -> Image.Image:
    full = Image.open(io.BytesIO(plot)).convert("RGB")
    return full.resize((WIDTH, round(WIDTH * full.height / full.width)), Image.Resampling.LANCZOS)


def grey(image: Image.Image) -> NDArray[np.float64]:
    return np.asarray(image, dtype=float)


def difference(one: Image.Image, other: Image.Image) -> float:
    return float(np.sqrt(np.mean((grey(one) - grey(other)) ** 2)))


@pytest.mark.parametrize("name", NAMES)
def test_the_numbers_and_the_plot_are_what_they_were(name: str, request: pytest.FixtureRequest) -> None:
    recipe, expected = HERE / name / "recipe.toml", HERE / name / "expected"
    kind = tomllib.loads(recipe.read_text())["kind"]
    drawn = (expected / PLOT).exists()
    found = compute(kind, read_cases(recipe, kind, ()), recipe, ("png",) if drawn else (), Execution())[0]
    plot = small(found.pop(f"{kind}.png")) if drawn else None
    if request.config.getoption("--update-golden"):
        for old in expected.glob("*"):
            if old.name not in (*found, "tolerance.toml", PLOT):
                old.unlink()
        files = {own: content for own, content in found.items() if own.endswith((".csv", ".toml"))}
        if plot is not None:
            buffer = io.BytesIO()
            plot.quantize(64, dither=Image.Dither.NONE).save(buffer, "png", optimize=True)
            files[PLOT] = buffer.getvalue()
        write_files(expected, files)
        return
    lines = differences(found, expected, RTOL)
    assert not lines, "\n".join([f"{len(lines)} differences", *lines[:20]])
    now, then = (tomllib.loads(text) for text in (found["summary.toml"].decode(), (expected / "summary.toml").read_text()))
    assert len(now.get("warnings", [])) == len(then.get("warnings", [])), now.get("warnings")
    if plot is not None:
        before = Image.open(expected / PLOT).convert("RGB")
        assert plot.size == before.size
        assert difference(plot, before) < DIFFERENCE


def test_a_missing_line_is_more_than_the_difference_allowed() -> None:
    then = Image.open(HERE / "relax-sweep" / "expected" / PLOT).convert("RGB")
    pixels = grey(then)
    colour = pixels.max(axis=2) - pixels.min(axis=2) > 60  # a coloured curve
    assert 0 < colour.sum() < 0.2 * colour.size
    pixels[colour] = 255
    assert difference(Image.fromarray(pixels.astype(np.uint8)), then) > DIFFERENCE


def test_every_subcommand_is_held() -> None:
    assert {name.split("-")[0] for name in NAMES} == {"mastercurve", "spectrum", "relax", "creep", "actuate", "failure", "design"}
    assert sum((HERE / name / "expected" / PLOT).exists() for name in NAMES) >= 8
