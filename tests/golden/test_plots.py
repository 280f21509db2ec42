"""The plots of some golden recipes look as they did when last looked at (`expected/plot.png`, refreshed by `--update-golden`).

They are compared small and blurred by that, as text is set a little differently from one version of a font library to the next.
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
from dielast.sharing.execution import Execution

HERE = Path(__file__).resolve().parent
WIDTH = 400  # pixels
DIFFERENCE = 6.0  # root mean square of grey levels, of 255; a line that is missing makes more
NAMES = [
    "actuate-to-the-end",
    "creep-force",
    "failure-map-grid",
    "failure-map-temperatures",
    "mastercurve-wlf",
    "relax-compare",
    "relax-sweep",
    "spectrum-nnls",
]


def picture(name: str) -> Image.Image:
    recipe = HERE / name / "recipe.toml"
    kind = tomllib.loads(recipe.read_text())["kind"]
    content = compute(kind, read_cases(recipe, kind, ()), recipe, ("png",), Execution())[0][f"{kind}.png"]
    full = Image.open(io.BytesIO(content)).convert("RGB")
    return full.resize((WIDTH, round(WIDTH * full.height / full.width)), Image.Resampling.LANCZOS)


def grey(image: Image.Image) -> NDArray[np.float64]:
    return np.asarray(image, dtype=float)


def difference(one: Image.Image, other: Image.Image) -> float:
    return float(np.sqrt(np.mean((grey(one) - grey(other)) ** 2)))


@pytest.mark.parametrize("name", NAMES)
def test_the_plot_looks_as_it_did(name: str, request: pytest.FixtureRequest) -> None:
    now, expected = picture(name), HERE / name / "expected"
    if request.config.getoption("--update-golden"):
        buffer = io.BytesIO()
        now.quantize(64, dither=Image.Dither.NONE).save(buffer, "png", optimize=True)
        write_files(expected, {"plot.png": buffer.getvalue()})
        return
    then = Image.open(expected / "plot.png").convert("RGB")
    assert now.size == then.size
    assert difference(now, then) < DIFFERENCE


def test_a_missing_line_is_more_than_the_difference_allowed() -> None:
    then = Image.open(HERE / "relax-sweep" / "expected" / "plot.png").convert("RGB")
    pixels = grey(then)
    colour = pixels.max(axis=2) - pixels.min(axis=2) > 60  # a coloured curve
    assert 0 < colour.sum() < 0.2 * colour.size
    pixels[colour] = 255
    assert difference(Image.fromarray(pixels.astype(np.uint8)), then) > DIFFERENCE
