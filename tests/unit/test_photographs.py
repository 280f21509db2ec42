"""Photographs of an electrode: axes, stretches and their errors on rendered pictures, geometry, files."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from photographs import Scene, into_plane, png_of_16_bit, render, saved, shaken, square_in_picture, tiff_of_16_bit
from PIL import Image

import dielast
from dielast import InputError
from dielast.readings.photographs.camera import Camera
from dielast.readings.photographs.decode import LARGEST, count_pictures, read_picture, taken
from dielast.readings.photographs.ellipse import Ellipse, fit_ellipse
from dielast.readings.photographs.outline import find_outline
from dielast.readings.photographs.series import BREAKDOWN, WRINKLES, measure_electrode, stretches

SMALL = Scene((150, 140), (74.3, 69.6), (80.0, 80.0), noise=0.02)


def extents(outline, axes=((1.0, 0.0), (0.0, 1.0))) -> list[float]:
    assert outline.flat is not None, outline
    return [2 * outline.flat.extent(np.array(axis))[0] for axis in axes]


def test_clean_axes_and_the_coverage_of_their_errors() -> None:
    errors, scaled = [], []
    for seed in range(16):
        scene = shaken(replace(SMALL, axes=(86.0, 80.0)), seed)
        outline = find_outline(render(scene))
        for axis, length in zip(np.eye(2), scene.axes, strict=True):
            half, stderr = outline.flat.extent(axis)
            errors.append(2 * half / length - 1)
            scaled.append((half - length / 2) / stderr)
    assert np.abs(errors).max() < 5e-4
    assert abs(np.mean(errors)) < 3e-5
    # of 32 intervals
    assert 0.8 <= np.mean(np.abs(scaled) < 1.645) <= 0.97


@pytest.mark.parametrize(
    "disturbed",
    [{"waves": (11, 0.006), "strips": (20.0, 200.0), "blur": 1.0}, pytest.param({"waves": (8, 0.01)}, marks=pytest.mark.trust)],
)
def test_the_coverage_of_the_errors_of_a_wrinkled_edge(disturbed: dict) -> None:
    scaled = []
    for seed in range(16):
        scene = shaken(replace(SMALL, axes=(88.0, 80.0), **disturbed), seed)
        outline = find_outline(render(scene))
        assert outline.roughness > 0.003
        scaled += [
            (half - length / 2) / stderr
            for axis, length in zip(np.eye(2), scene.axes, strict=True)
            for half, stderr in [outline.flat.extent(axis)]
        ]
    assert 0.8 <= np.mean(np.abs(scaled) < 1.645) <= 0.97


def test_errors_hold_for_an_electrode_centred_on_the_grid_of_coarsely_sampled_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its four quarters meet the grid alike: their errors add up."""
    monkeypatch.setattr("photographs.FINE", 4)
    scaled = []
    for seed in range(20):
        scene = replace(SMALL, centre=(74.0, 70.0), axes=(78.0 + 0.173 * seed, 86.0 - 0.119 * seed), seed=seed)
        outline = find_outline(render(scene))
        for axis, length in zip(np.eye(2), scene.axes, strict=True):
            half, stderr = outline.flat.extent(axis)
            scaled.append((half - length / 2) / stderr)
    assert np.mean(np.square(scaled)) < 1.3
    assert 0.8 <= np.mean(np.abs(scaled) < 1.645) <= 0.97


@pytest.mark.parametrize(
    ("scene", "quality", "limit"),
    [
        (Scene(strips=(20.0, 200.0), light=0.4, blur=2.0, noise=0.05), 60, 0.003),
        (Scene(strips=(90.0, 180.0), vignette=0.4, blur=2.0, noise=0.05), 60, 0.003),
        (Scene(waves=(8, 0.01), hairs=1, dust=15, glare=0.1, marks=4, noise=0.02), 95, 0.004),
    ],
)
def test_strips_light_blur_wrinkles_and_glare_do_not_pull_the_outline(scene: Scene, quality: int, limit: float) -> None:
    changed = shaken(replace(scene, axes=(220.0, 205.0)), 0)
    outline = find_outline(read_picture(saved(render(changed), "jpg", quality=quality), "photo.jpg"))
    assert extents(outline) == pytest.approx(changed.axes, rel=limit)
    assert outline.inside


@pytest.mark.parametrize(
    "form",
    [
        {"cast": (1.0, 0.7, 0.5)},
        {"depth": 16},
        {"cast": (1.0, 0.7, 0.5), "depth": 16},
        {"form": "tif", "depth": 16},
        {"form": "gif"},
    ],
)
def test_a_light_electrode_in_every_kind_of_file(form: dict) -> None:
    scene = shaken(Scene((150, 140), (74.0, 69.0), (60.0, 66.0), electrode=0.8, film=0.3, noise=0.02), 3)
    outline = find_outline(read_picture(saved(render(scene), **form), "photo"), dark=False)
    assert extents(outline) == pytest.approx(scene.axes, rel=0.005)


def test_colour_of_16_bit_is_read_to_the_last_bit() -> None:
    levels = np.random.default_rng(5).integers(0, 1 << 16, (9, 14, 3), dtype=np.uint16)
    tiffs = [tiff_of_16_bit(levels, order, deflated) for order in "<>" for deflated in (False, True)]
    for content in (png_of_16_bit(levels), *tiffs):
        assert np.array_equal(read_picture(content, "photo", channel="blue"), levels[..., 2])
        assert np.array_equal(read_picture(content, "photo"), levels.sum(axis=-1))


def test_a_square_corrects_tilt_and_lens() -> None:
    scene = Scene(noise=0.01, tilt=10.0, tilt_axis=0.0, axes=(200.0, 190.0), centre=(205.0, 170.0))
    picture = render(scene)
    camera = Camera.of_square(square_in_picture(scene, 280.0), scene.size)
    assert camera.side == pytest.approx(280.0, rel=1e-3)
    assert extents(find_outline(picture, camera=camera)) == pytest.approx(scene.axes, rel=5e-4)
    # uncorrected, one direction is shortened
    assert extents(find_outline(picture))[1] < 0.987 * 190.0

    bent = replace(scene, lens=0.03, tilt=0.0)
    corners = np.array(square_in_picture(bent, 280.0))
    on_sides = []
    for first, last in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        ends = np.stack(into_plane(bent, *np.array([first, last]).T), axis=1)
        # points of the straight side, as the lens shows them
        for share in (0.3, 0.7):
            point = found = (1 - share) * ends[0] + share * ends[1]
            for _ in range(60):
                found = found - (np.array(into_plane(bent, *found)) - point)
            on_sides.append(found)
    lens = Camera.of_square([*corners.tolist(), *np.array(on_sides).tolist()], bent.size)
    assert lens.lens / lens.scale**2 == pytest.approx(0.03 / np.hypot(199.5, 159.5) ** 2, rel=1e-2)
    middle = lens.flattened(np.array([[150.0, 100.0], [250.0, 100.0]]))
    assert np.ptp(middle[:, 0]) == pytest.approx(
        np.ptp(into_plane(bent, np.array([150.0, 250.0]), np.array([100.0, 100.0]))[0]), rel=1e-3
    )


def test_a_circle_corrects_the_tilt_of_a_camera_far_away() -> None:
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    camera = Camera.of_circle(np.stack([100 + 50 * np.cos(turn), 90 + 47 * np.sin(turn)], axis=1).tolist())
    flat = camera.flattened(np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 9.4]]))
    assert np.hypot(*(flat[1:] - flat[0]).T) == pytest.approx([10.0, 10.0])
    with pytest.raises(InputError, match="in order around it"):
        Camera.of_square([[0, 0], [10, 10], [10, 0], [0, 10]])


def test_the_ellipse_of_exact_points_and_of_points_with_outliers() -> None:
    true = Ellipse(np.array([3.0, -2.0]), np.array([[30.0, 6.0], [6.0, 20.0]]))
    points, normal, curvature = true.around(200)
    found, kept = fit_ellipse(points, np.ones(200, bool), Ellipse(np.zeros(2), 20 * np.eye(2)), 1e-6)
    assert found.shape == pytest.approx(true.shape, abs=1e-9)
    assert kept.all()
    disturbed = points + np.where(np.arange(200) % 7 == 0, 4.0, 0.0)[:, None] * normal
    found, kept = fit_ellipse(disturbed, np.ones(200, bool), Ellipse(np.zeros(2), 20 * np.eye(2)), 1e-6)
    assert found.shape == pytest.approx(true.shape, abs=1e-6)
    assert np.count_nonzero(~kept) == 29
    b, a = true.semi_axes
    assert [curvature.min(), curvature.max()] == pytest.approx([b / a**2, a / b**2], rel=1e-2)
    assert np.hypot(*(points - np.roll(points, 1, axis=0)).T).sum() == pytest.approx(true.perimeter, rel=1e-3)


def test_stretches_along_the_axes_of_the_film_from_any_reference() -> None:
    """A film that is stretched along its axes, which are turned in the picture, with an electrode that was no circle."""
    turn = np.deg2rad(25.0)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])  # rows: axis 1, axis 2; y points down
    first = np.array([[50.0, 8.0], [8.0, 42.0]])
    deformation = axes.T @ np.diag([1.3, 0.95]) @ axes
    second = deformation @ first @ first.T @ deformation.T
    values, vectors = np.linalg.eigh(second)
    outlines = [
        replace(find_outline(render(SMALL)), flat=Ellipse(np.zeros(2), shape))
        for shape in (first, (vectors * np.sqrt(values)) @ vectors.T)
    ]
    result = stretches(["a", "b"], np.array([0.0, 1.0]), outlines, outlines[0], axis_1=25.0)
    assert result.stretch[1] == pytest.approx([1.3, 0.95])
    assert result.area_strain[1] == pytest.approx(1.3 * 0.95 - 1)
    assert result.stderr[0].tolist() == [0.0, 0.0]
    assert Ellipse(np.zeros(2), 50 * deformation).angle == pytest.approx(25.0)


def test_a_series_marks_what_happens_and_what_is_lost() -> None:
    pictures = [render(replace(SMALL, axes=(80.0 + k, 80.0), seed=k)) for k in range(8)]
    pictures[2] = np.full((140, 150), 0.8)
    pictures[4] = render(replace(SMALL, axes=(110.0, 80.0), seed=4))
    y, x = np.mgrid[:140, :150]
    for picture in pictures[6:]:
        picture[np.hypot(x - 80, y - 60) < 8] = 0.9
    result = dielast.measure_electrode(pictures, np.arange(8.0))
    assert result.state == ("ok", "ok", "lost", "ok", "doubtful", "ok", "doubtful", "doubtful")
    assert result.events == {BREAKDOWN: 6}
    assert result.stretch[5] == pytest.approx([85 / 80, 1.0], rel=1e-3)
    assert np.isnan(result.stretch[2]).all()
    assert list(result.to_frame()["state"]) == list(result.state)
    assert repr(result) == "Stretches(8 photographs: 4 ok, 3 doubtful, 1 lost)"

    wrinkled = [pictures[0], render(replace(SMALL, waves=(9, 0.03), seed=9))]
    assert measure_electrode(wrinkled, [0.0, 8.0]).events == {WRINKLES: 1}


@pytest.mark.parametrize(
    ("picture", "reason"),
    [
        (np.full((140, 150), 0.7), "no electrode is found"),
        (0.7 + 0.01 * np.random.default_rng(1).normal(size=(140, 150)), "no electrode is found"),
        (np.linspace(0, 1, 140)[:, None] + np.zeros((140, 150)), "no electrode is found"),
        (render(replace(SMALL, centre=(149.0, 70.0))), "an electrode is seen on only"),
        (render(replace(SMALL, size=(230, 140), second=True)), "two electrodes are found: state a region that holds one"),
        (np.zeros((1, 1)), "the picture has only 1 x 1 pixels"),
    ],
)
def test_a_picture_without_a_clear_electrode_says_why(picture: np.ndarray, reason: str) -> None:
    outline = find_outline(picture)
    assert outline.flat is None
    assert outline.reason.startswith(reason)


@pytest.mark.parametrize("frame", [15, 40])
def test_a_dark_frame_that_a_wire_joins_to_the_electrode_is_none(frame: int) -> None:
    scene = replace(SMALL, size=(240, 210), centre=(121.3, 104.7), axes=(90.0, 84.0))
    picture = render(scene)
    height, width = picture.shape
    y, x = np.mgrid[:height, :width]
    dark = (np.minimum(x, width - 1 - x) < frame) | (np.minimum(y, height - 1 - y) < frame) | ((np.abs(y - 104) < 4) & (x < 121))
    outline = find_outline(np.where(dark, np.minimum(picture, 0.2), picture))
    assert extents(outline) == pytest.approx(scene.axes, rel=1e-3)
    assert find_outline(np.where(dark, 0.2, 0.8)).reason.endswith("a region around it may help")


def test_a_region_holds_one_of_two_electrodes() -> None:
    picture = render(replace(SMALL, size=(230, 140), second=True))
    outline = find_outline(picture, region=(0, 0, 128, 140))
    assert extents(outline) == pytest.approx([80.0, 80.0], rel=1e-3)
    assert outline.ellipse.centre == pytest.approx(SMALL.centre, abs=0.05)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "no picture"),
        (b"%PDF-1.4\n", "no picture: PNG, JPEG, TIFF or GIF is needed"),
        (saved(np.full((40, 40), 0.5), "jpg")[:300], "cannot be decoded, perhaps it is cut off or damaged"),
        (saved(np.full((40, 40), 0.5))[:60], "cannot be decoded"),
    ],
)
def test_what_is_no_picture_is_refused_by_its_name(content: bytes, text: str) -> None:
    with pytest.raises(InputError, match=text) as caught:
        read_picture(content, "photo.png")
    assert str(caught.value).startswith("photo.png: ")


def test_a_picture_that_would_fill_the_memory_is_refused_before_it_is_decoded() -> None:
    buffer = io.BytesIO()
    Image.new("1", (20_000, LARGEST // 20_000 + 1)).save(buffer, "png")
    with pytest.raises(InputError, match="at most 50 million are read"):
        read_picture(buffer.getvalue(), "bomb.png")


def test_exif_turns_and_dates_a_picture_and_a_stack_holds_several() -> None:
    levels = np.arange(200, dtype=np.uint8).reshape(10, 20)
    exif = Image.Exif()
    exif[0x0112] = 6  # turned by a quarter
    exif.get_ifd(0x8769)[0x9003] = "2024:05:06 07:08:09"
    exif.get_ifd(0x8769)[0x9291] = "25"
    buffer = io.BytesIO()
    Image.fromarray(levels).save(buffer, "png", exif=exif)
    assert read_picture(buffer.getvalue(), "photo.png").shape == (20, 10)
    assert taken(buffer.getvalue(), "photo.png") % 60 == pytest.approx(9.25)
    with pytest.raises(InputError, match="EXIF does not say when it was taken"):
        taken(saved(np.zeros((9, 9))), "photo.png")
    stack = io.BytesIO()
    frames = [Image.fromarray(np.full((12, 12), level, np.uint16)) for level in (10, 3000)]
    frames[0].save(stack, "tiff", save_all=True, append_images=frames[1:])
    assert count_pictures(stack.getvalue(), "stack.tif") == 2
    assert read_picture(stack.getvalue(), "stack.tif", 1).max() == 3000
