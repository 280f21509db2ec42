"""The pictures of a file: grey values, and when they were taken. Pillow decodes them, within limits."""

import io
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, listed

FORMATS = ("PNG", "JPEG", "TIFF", "GIF")
LARGEST = 50_000_000  # pixels: decoded and as grey values a picture takes up to 15 bytes each
LARGEST_DEEP = 40_000_000  # pixels of colour with 16 bit, which take up to 24 bytes each beside the file
MOST = 100_000  # pictures in a file
CHANNELS = ("red", "green", "blue")
MEAN = "mean"
_DIRECTORY, _TAKEN, _FRACTION, _CHANGED = 0x8769, 0x9003, 0x9291, 0x0132  # tags of EXIF
_DEEP = re.compile(r"((?:RGB|RGBA|RGBX);16)([BLN])")  # Pillow's names of colour with 16 bit, and of the order of its bytes

Picture = NDArray[Any]


def count_pictures(content: bytes, name: str) -> int:
    """The number of pictures in a file: one, or those of an animated GIF or a TIFF stack. Raises `InputError`."""
    with _opened(content, name) as image:
        count = int(getattr(image, "n_frames", 1))
    if count > MOST:
        raise InputError(f"{count} pictures are too many: at most {MOST} are read", file=name)
    return count


def read_picture(content: bytes, name: str, number: int = 0, channel: str = MEAN) -> Picture:
    """The grey values (height, width) of the picture with this `number` (from 0), turned as EXIF says.

    `channel` says which colour is read: red, green, blue or their mean. Values are those of the file: neither a gamma curve nor a
    colour profile is undone. Raises `InputError` for a file that is no picture, is cut off, or has more than `LARGEST` pixels, or
    `LARGEST_DEEP` in colour with 16 bit.
    """
    with _opened(content, name) as image:
        if number:
            image.seek(number)
        width, height = image.size
        low = _of_low_bytes(image)
        most = LARGEST if low is None else LARGEST_DEEP
        if width * height > most:
            limit = f"at most {most // 10**6} million are read: reduce the picture, or cut out the electrode"
            raise InputError(f"{width} x {height} pixels: {limit}", file=name)
        values = _values(image, channel)
    if low is None:
        return values
    with _opened(content, name) as image:
        if number:
            image.seek(number)
        image.tile = low
        low_values = _values(image, channel)
    values = np.left_shift(values, 8, dtype=np.uint32)
    values += low_values
    return values


def _of_low_bytes(image: Any) -> list[Any] | None:
    """The tiles of a picture of 16 bit in colour, such that Pillow decodes the low bytes of its values; None for other pictures.

    Pillow keeps 8 bit of each colour, the high bytes; in the other byte order it takes the low ones for them.
    """
    native = "L" if sys.byteorder == "little" else "B"
    tiles = []
    for tile in image.tile:
        rawmode, *more = (tile.args,) if isinstance(tile.args, str) else tile.args or ("",)
        match = _DEEP.fullmatch(str(rawmode))
        if match is None:
            return None
        order = native if match[2] == "N" else match[2]
        other = f"{match[1]}{'B' if order == 'L' else 'L'}"
        tiles.append(tile._replace(args=other if isinstance(tile.args, str) else (other, *more)))
    return tiles or None


def _values(image: Any, channel: str) -> Picture:
    """The grey values of a picture that Pillow has opened, or those of one colour."""
    from PIL import ImageOps

    ImageOps.exif_transpose(image, in_place=True)
    picture = image
    if picture.mode == "1":
        picture = picture.convert("L")
    elif picture.mode == "LA":
        picture = picture.getchannel(0)
    elif picture.mode not in ("L", "I", "F", "RGB", "RGBA", "RGBX") and not picture.mode.startswith("I;16"):
        picture = picture.convert("RGB")
    if not picture.mode.startswith("RGB"):
        return np.asarray(picture)
    if channel in CHANNELS:
        return np.asarray(picture.getchannel(CHANNELS.index(channel)))
    # the sum is as good as the mean; one colour after the other, because all at once would take twice the memory
    total = np.zeros((picture.height, picture.width), dtype=np.uint16)
    for number in range(len(CHANNELS)):
        total += np.asarray(picture.getchannel(number))
    return total


def taken(content: bytes, name: str) -> float:
    """When a photograph was taken, in s, by its EXIF; raises `InputError` if it does not say."""
    with _opened(content, name) as image:
        exif = image.getexif()
        inner = exif.get_ifd(_DIRECTORY)
        stated, fraction = inner.get(_TAKEN) or exif.get(_CHANGED), inner.get(_FRACTION)
    try:
        moment = datetime.strptime(str(stated).strip("\0 "), "%Y:%m:%d %H:%M:%S")
    except ValueError:
        raise InputError("EXIF does not say when it was taken: state times or interval", file=name) from None
    digits = "".join(mark for mark in str(fraction or "") if mark.isdecimal())
    return (moment - datetime(1970, 1, 1)).total_seconds() + float(f"0.{digits or 0}")


@contextmanager
def _opened(content: bytes, name: str) -> Iterator[Any]:
    """The file as Pillow has it; whatever goes wrong with it is an `InputError`."""
    from PIL import Image, UnidentifiedImageError

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of damaged tags, and of large pictures: the limit is ours
        try:
            with Image.open(io.BytesIO(content), formats=FORMATS) as image:
                yield image
        except InputError:
            raise
        except Image.DecompressionBombError:
            raise InputError(f"more than {LARGEST // 10**6} million pixels: reduce the picture", file=name) from None
        except UnidentifiedImageError:
            raise InputError(f"no picture: {listed(FORMATS)} is needed", file=name) from None
        except MemoryError:
            raise InputError("the picture does not fit into memory", file=name) from None
        except Exception as error:  # decoders raise many kinds of errors for a damaged file
            said = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(f"cannot be decoded, perhaps it is cut off or damaged: {said}", file=name) from None
