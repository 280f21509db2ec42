"""How well photographs are measured: each regime over many renderings, the time of a photograph, and memory.

    python tests/bench/bench_photographs.py [RENDERINGS [REGIME...]]

An electrode is rendered at stretch 1 and at 1.1 and 1.05 along its axes; errors are those of the axes and of the two stretches.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))
from photographs import Scene, render, saved, shaken, square_in_picture

from dielast.readings.photographs.camera import Camera
from dielast.readings.photographs.decode import read_picture
from dielast.readings.photographs.outline import find_outline
from dielast.readings.photographs.series import stretches


@dataclass(frozen=True, slots=True)
class Regime:
    scene: Scene
    limit: float  # of the stretches
    of_axes: float | None = None
    save: Callable[[np.ndarray], bytes] = saved
    dark: bool = True
    square: bool = False


LARGE = Scene((1632, 1224), (815.0, 611.0), (700.0, 700.0))
REGIMES = {
    "clean": Regime(Scene(noise=0.02), 0.0007, 0.0005),
    "strips": Regime(
        Scene(strips=(20.0, 200.0), light=0.4, blur=2.0, noise=0.05), 0.003, 0.003, lambda p: saved(p, "jpg", quality=60)
    ),
    "strips, vignette": Regime(
        Scene(strips=(90.0, 180.0), vignette=0.4, blur=2.0, noise=0.05), 0.003, 0.003, lambda p: saved(p, "jpg", quality=60)
    ),
    "wrinkles": Regime(Scene(waves=(8, 0.01), hairs=1, dust=15, glare=0.1, marks=4, noise=0.02), 0.004, 0.004),
    "wrinkles, blur": Regime(Scene(waves=(8, 0.01), hairs=2, dust=15, glare=0.1, marks=4, noise=0.02, blur=1.5), 0.004, 0.004),
    "small, cast": Regime(
        Scene((170, 150), (85.0, 74.0), (60.0, 60.0), electrode=0.8, film=0.3, noise=0.02),
        0.005,
        0.005,
        lambda p: saved(p, cast=(1.0, 0.75, 0.5)),
        False,
    ),
    "small, 16 bit": Regime(
        Scene((170, 150), (85.0, 74.0), (60.0, 60.0), electrode=0.8, film=0.3, noise=0.02),
        0.005,
        0.005,
        lambda p: saved(p, depth=16),
        False,
    ),
    "tilt": Regime(Scene(tilt=10.0, tilt_axis=30.0, noise=0.02), 0.003, 0.003, square=True),
    "tilt, uncorrected": Regime(Scene(tilt=10.0, tilt_axis=0.0, noise=0.02), 0.003, 0.003),
}


def measured(regime: Regime, seed: int) -> tuple[list[float], list[float], list[float], float]:
    """Errors of the axes and of the stretches, those over their standard errors, and the time for a photograph."""
    pair, taken = [], 0.0
    camera = Camera.of_square(square_in_picture(regime.scene, 280.0), regime.scene.size) if regime.square else None
    truth = []
    for number, factors in enumerate(((1.0, 1.0), (1.1, 1.05))):
        axes = tuple(axis * factor for axis, factor in zip(regime.scene.axes, factors, strict=True))
        scene = shaken(replace(regime.scene, axes=axes), 2 * seed + number)
        content = regime.save(render(scene))
        start = time.process_time()
        pair.append(find_outline(read_picture(content, "photo"), dark=regime.dark, camera=camera))
        taken += time.process_time() - start
        truth.append(axes)
    if any(outline.flat is None for outline in pair):
        raise RuntimeError(f"seed {seed}: {pair}")
    result = stretches(["a", "b"], np.arange(2.0), pair, pair[0], camera=camera)
    of_axes = [
        2 * outline.flat.extent(direction)[0] / axis - 1
        for outline, axes in zip(pair, truth, strict=True)
        for direction, axis in zip(np.eye(2), axes, strict=True)
    ]
    errors = result.stretch[1] - [1.1, 1.05]
    return of_axes, (errors / [1.1, 1.05]).tolist(), (errors / result.stderr[1]).tolist(), taken / 2


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    print(f"{count} renderings each; errors in % (median and largest), coverage of 90 % intervals, s per photograph")
    for name, regime in REGIMES.items():
        if len(sys.argv) > 2 and name not in sys.argv[2:]:
            continue
        axes, errors, scaled, taken = (
            np.array(values) for values in zip(*(measured(regime, k) for k in range(count)), strict=True)
        )
        within = np.mean(np.abs(scaled) < 1.645)
        print(
            f"{name:20s} axes {100 * np.median(abs(axes)):.4f} {100 * abs(axes).max():.4f} of {100 * (regime.of_axes or 0):.2f}"
            f"   stretches {100 * np.median(abs(errors)):.4f} {100 * abs(errors).max():.4f} of {100 * regime.limit:.2f}"
            f"   covers {within:.0%}   {taken.mean():.3f} s",
            flush=True,
        )
    if len(sys.argv) > 2:
        return
    picture = render(replace(LARGE, noise=0.02, light=0.2))
    for form, options in (("jpg", {"quality": 90}), ("png", {}), ("tif", {})):
        content = saved(picture, form, cast=(1.0, 0.9, 0.8), **options)
        start = time.process_time()
        for _ in range(5):
            find_outline(read_picture(content, "photo"))
        print(f"2 megapixels, colour, {form}: {(time.process_time() - start) / 5:.3f} s per photograph ({len(content) >> 10} KiB)")
    print(f"memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10} MiB")


if __name__ == "__main__":
    main()
