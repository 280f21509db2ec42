"""The equations of films under load, in any of their forms."""

from dielast.mechanics.passive.framed import FramedFilms
from dielast.mechanics.point import LoadedPoints
from dielast.numerics.stride import TriedStep

Films = LoadedPoints | FramedFilms


def films_of(stride: TriedStep) -> Films:
    """The films that a step of the stepper integrates."""
    assert isinstance(stride.system, Films)
    return stride.system
