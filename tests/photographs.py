"""Photographs of an electrode, rendered from its geometry: written apart from the method that measures them.

Every pixel is the mean of the scene over its area, from a fine grid of points in it; then light, blur, noise, and a camera's file.
"""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

Array = NDArray[np.float64]
FINE = 20  # points along each side of a pixel


@dataclass(frozen=True, slots=True)
class Scene:
    """An electrode with the full axes `axes` in px along directions at `angle` (degrees, anticlockwise), and all that disturbs."""

    size: tuple[int, int] = (400, 320)  # width, height
    centre: tuple[float, float] = (199.3, 160.7)
    axes: tuple[float, float] = (200.0, 200.0)
    angle: float = 0.0
    electrode: float = 0.2
    film: float = 0.8
    strips: tuple[float, ...] = ()  # directions of contact strips, degrees
    strip_width: float = 0.15  # of the diameter
    light: float = 0.0  # lost from one corner to the other
    vignette: float = 0.0
    blur: float = 0.0
    noise: float = 0.0  # of the contrast
    waves: tuple[int, float] = (0, 0.0)  # number, relative amplitude of the radius
    phase: float = 0.0
    hairs: int = 0
    dust: int = 0
    glare: float = 0.0  # share of the rim
    marks: int = 0
    tilt: float = 0.0  # degrees
    tilt_axis: float = 0.0  # degrees
    distance: float = 1500.0  # px
    lens: float = 0.0
    second: bool = False
    seed: int = 0


def scene_at(scene: Scene, x: Array, y: Array, random: np.random.Generator) -> Array:
    """The brightness of the film's plane at points, without light."""
    cx, cy = scene.centre
    a = np.deg2rad(scene.angle)
    u = ((x - cx) * np.cos(a) - (y - cy) * np.sin(a)) / (scene.axes[0] / 2)
    v = ((x - cx) * np.sin(a) + (y - cy) * np.cos(a)) / (scene.axes[1] / 2)
    number, amplitude = scene.waves
    inside = np.hypot(u, v) <= 1 + amplitude * np.cos(number * np.arctan2(v, u) + scene.phase)
    mean = np.sqrt(scene.axes[0] * scene.axes[1])
    for direction in scene.strips:
        s = np.deg2rad(direction)
        along, across = (x - cx) * np.cos(s) - (y - cy) * np.sin(s), (x - cx) * np.sin(s) + (y - cy) * np.cos(s)
        inside |= (along > 0) & (np.abs(across) <= scene.strip_width * mean / 2)
    if scene.second:
        inside |= np.hypot(x - cx - 1.3 * mean, y - cy) <= mean / 2.2
    bright = np.where(inside, scene.electrode, scene.film)
    for k in range(scene.marks):
        turn = np.pi * (0.25 + 0.5 * k) + random.uniform(-0.2, 0.2)
        radius = mean / 2 * random.choice([0.6, 0.95, 1.0, 1.1])
        bright = np.where(np.hypot(x - cx - radius * np.cos(turn), y - cy - radius * np.sin(turn)) <= 0.025 * mean, 0.95, bright)
    for _ in range(scene.hairs):
        turn, lean, bend = random.uniform(0, 2 * np.pi), random.uniform(0, np.pi), random.uniform(-0.3, 0.3) / mean
        px, py = x - cx - mean / 2 * np.cos(turn), y - cy - mean / 2 * np.sin(turn)
        along, across = px * np.cos(lean) + py * np.sin(lean), -px * np.sin(lean) + py * np.cos(lean)
        bright = np.where((np.abs(across - bend * along**2) <= 1.2) & (np.abs(along) <= 0.35 * mean), 0.1, bright)
    for _ in range(scene.dust):
        px, py, radius = random.uniform(0, scene.size[0]), random.uniform(0, scene.size[1]), random.uniform(1, 4)
        bright = np.where(np.hypot(x - px, y - py) <= radius, random.choice([0.1, 0.9]), bright)
    return bright


def into_plane(scene: Scene, x: Array, y: Array) -> tuple[Array, Array]:
    """The point of the film's plane that a tilted camera with a lens shows at x, y."""
    middle = (np.array(scene.size) - 1) / 2
    x, y = x - middle[0], y - middle[1]
    if scene.lens:
        reach = 1 + scene.lens * (x**2 + y**2) / np.hypot(*middle) ** 2
        x, y = x * reach, y * reach
    if scene.tilt:
        s, t = np.deg2rad(scene.tilt_axis), np.deg2rad(scene.tilt)
        along, across = x * np.cos(s) + y * np.sin(s), -x * np.sin(s) + y * np.cos(s)
        # a ray through (along, across) meets the plane that is turned by t about the axis
        depth = scene.distance / (scene.distance * np.cos(t) - across * np.sin(t))
        along, across = along * np.cos(t) * depth, across * depth
        x, y = along * np.cos(s) - across * np.sin(s), along * np.sin(s) + across * np.cos(s)
    return x + middle[0], y + middle[1]


def square_in_picture(scene: Scene, side: float) -> list[list[float]]:
    """Where the camera shows the corners of a square in the plane around the middle of the picture."""
    middle = (np.array(scene.size) - 1) / 2
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * side / 2 + middle
    found = corners.copy()
    for _ in range(60):  # Newton on the inverse mapping, with its slope by differences
        x, y = into_plane(scene, found[:, 0], found[:, 1])
        found -= np.stack([x, y], axis=1) - corners
    return found.tolist()


def render(scene: Scene) -> Array:
    """The picture (height, width) between 0 and 1."""
    random = np.random.default_rng(scene.seed)
    width, height = scene.size
    rows, columns = np.mgrid[:height, :width].astype(float)
    state = random.bit_generator.state

    def plane(x: Array, y: Array) -> Array:
        random.bit_generator.state = state
        return scene_at(scene, *into_plane(scene, x, y), random)

    picture = plane(columns, rows)
    corners = plane(*(grid - 0.5 for grid in np.meshgrid(np.arange(width + 1.0), np.arange(height + 1.0))))
    around = np.stack([picture, corners[1:, 1:], corners[1:, :-1], corners[:-1, 1:], corners[:-1, :-1]])
    # also the pixels beside an edge: it may cut a corner
    mixed = ndimage.binary_dilation(np.ptp(around, axis=0) > 0, np.ones((3, 3)))
    steps = (np.arange(FINE) + 0.5) / FINE - 0.5
    dx, dy = (grid.ravel() for grid in np.meshgrid(steps, steps))
    picture[mixed] = plane(columns[mixed][:, None] + dx, rows[mixed][:, None] + dy).mean(axis=1)
    if scene.glare:
        turn, spread = random.uniform(0, 2 * np.pi), np.pi * scene.glare
        mean = np.sqrt(scene.axes[0] * scene.axes[1]) / 2
        x, y = columns - scene.centre[0], rows - scene.centre[1]
        away = np.angle(np.exp(1j * (np.arctan2(y, x) - turn)))
        strength = 1 / (1 + np.exp((np.hypot(away / spread, (np.hypot(x, y) - mean) / (0.12 * mean)) - 1) * 12))
        picture = picture + strength * (1.2 - picture)
    fall = (columns / width + rows / height) / 2
    off = ((columns / width - 0.5) ** 2 + (rows / height - 0.5) ** 2) / 0.5
    picture = picture * (1 - scene.light * fall) * (1 - scene.vignette * off)
    if scene.blur:
        picture = ndimage.gaussian_filter(picture, scene.blur, mode="nearest")
    picture = picture + random.normal(0.0, scene.noise * abs(scene.film - scene.electrode), picture.shape)
    return np.clip(picture, 0.0, 1.0)


def saved(
    picture: Array, form: str = "png", *, depth: int = 8, cast: tuple[float, float, float] | None = None, **options: Any
) -> bytes:
    """The picture as the bytes of a file: grey or with a colour cast, 8 or 16 bit."""
    full = 65535 if depth == 16 else 255
    colours = picture if cast is None else np.clip(picture[..., None] * np.array(cast), 0, 1)
    levels = np.round(colours * full).astype(np.uint16 if depth == 16 else np.uint8)
    if cast is not None and depth == 16:
        return png_of_16_bit(levels)
    buffer = io.BytesIO()
    Image.fromarray(levels).save(buffer, {"jpg": "jpeg", "tif": "tiff"}.get(form, form), **options)
    return buffer.getvalue()


def png_of_16_bit(levels: NDArray[np.uint16]) -> bytes:
    """The colours (height, width, 3) as a PNG, which Pillow does not write."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, _ = levels.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in levels)
    head = struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def tiff_of_16_bit(levels: NDArray[np.uint16], order: str, deflated: bool) -> bytes:
    """The colours (height, width, 3) as a TIFF, with the bytes in the `order` < or >."""
    height, width, _ = levels.shape
    data = levels.astype(f"{order}u2").tobytes()
    data = zlib.compress(data) if deflated else data
    start = 8 + 2 + 12 * 9 + 4
    bits = struct.pack(f"{order}3H", 16, 16, 16)
    values = {256: width, 257: height, 258: start, 259: 8 if deflated else 1, 262: 2, 273: start + 6, 277: 3, 278: height}
    entries = [struct.pack(f"{order}HHII", tag, 4, 1, value) for tag, value in (values | {279: len(data)}).items()]
    entries[2] = struct.pack(f"{order}HHII", 258, 3, 3, start)
    magic = (b"II" if order == "<" else b"MM") + struct.pack(f"{order}HIH", 42, 8, 9)
    return magic + b"".join(entries) + bytes(4) + bits + data


def shaken(scene: Scene, seed: int) -> Scene:
    """The scene with its centre and everything random elsewhere."""
    random = np.random.default_rng(1000 + seed)
    x, y = scene.centre
    return replace(
        scene, centre=(x + random.uniform(-5, 5), y + random.uniform(-5, 5)), phase=random.uniform(0, 2 * np.pi), seed=seed
    )
