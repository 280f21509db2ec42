"""The recipe of `measure` for given photographs."""

import os
import re
from collections.abc import Sequence
from pathlib import Path

from dielast.base.errors import InputError
from dielast.io.files import resolve
from dielast.readings.photographs.decode import count_pictures, taken
from dielast.readings.seen import Given
from dielast.recipe.file_fields import PICTURES
from dielast.recipe.lines import FILL, RecipeLines

_TIME = re.compile(r"(\d+(?:\.\d+)?)(?= ?_?(ms|s|min|h)(?![A-Za-z0-9]))")


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe; raises `InputError` for files that are no photographs."""
    names = given.names
    folder = len(names) == 1 and os.path.isdir(resolve(given.inputs.folder, names[0]))
    inside = [path.name for path in resolve(given.inputs.folder, names[0]).iterdir()] if folder else []
    if folder and not any(name.lower().endswith(PICTURES) for name in inside):
        raise InputError(f"no file in this folder ends with {', '.join(PICTURES)}", file=names[0])
    if wrong := [name for name in names if not folder and not name.lower().endswith(PICTURES)]:
        raise InputError(f"no photograph: one of {', '.join(PICTURES)} is needed", file=wrong[0])
    recipe = RecipeLines(kind, "Photographs of an electrode -> stretches over time.")
    count = "" if folder else f"{len(names)} photographs"
    if len(names) == 1 and not folder:
        count = f"{count_pictures(given.inputs.read(names[0]), names[0])} pictures"
    recipe.key("files", names[0] if len(names) == 1 else given.stated, count)
    pattern = _pattern(names)
    if pattern is not None:
        recipe.key("times", pattern, "from the names of the files")
    elif not folder and _all_say(given):
        recipe.key("times", "exif", "all photographs say when they were taken")
    else:
        recipe.key(
            "interval", FILL, "from one photograph to the next; neither their names nor their EXIF state a time with its unit"
        )
    recipe.section("[electrode]")
    recipe.key("dark", True, "CHECK: darker than the film around it")
    recipe.option('reference = "photo.png"', "of stretch 1; default: the first photograph")
    recipe.option('diameter = "10 mm"', "of stretch 1, instead of a reference, with scale, the length of a pixel")
    recipe.option('axis_1 = "0 deg"', "of the film, from the horizontal to the right, anticlockwise")
    return recipe


def _pattern(names: Sequence[str]) -> str | None:
    """The pattern of times in the names of the files; None if not all of them state one in the same way."""
    patterns = {_TIME.sub(lambda match: f"{{{match[2]}}}", Path(name).name, count=1) for name in names}
    pattern = patterns.pop()
    return pattern if not patterns and len(names) > 1 and "{" in pattern else None


def _all_say(given: Given) -> bool:
    """Whether EXIF says of every photograph when it was taken."""
    try:
        times = [taken(given.inputs.read(name), name) for name in given.names]
    except InputError:
        return False
    return len(set(times)) == len(times)
