"""Types of arguments: a public function, or a class that users make, refuses a value that its annotation does not allow."""

import typing
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import cache, wraps
from inspect import signature
from itertools import repeat
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, listed, shown
from dielast.numerics.arrays import Floats

WORDS: dict[Any, tuple[str, str]] = {  # one value, and the entries of a list
    float: ("a number in SI units", "numbers"),
    int: ("a whole number", "whole numbers"),
    bool: ("True or False", "truth values"),
    str: ("text", "names"),
    Callable: ("a function", "functions"),
    np.ndarray: ("a number in SI units or a list of numbers", "numbers"),
}
# kinds that numpy converts without a warning: a duration to its count of nanoseconds, a complex number to its real part
NO_NUMBERS = {"m": "durations", "M": "dates", "c": "complex numbers", "U": "text", "S": "text"}
_LIKE_ARRAYS = {*get_args(ArrayLike)}

Public = TypeVar("Public", bound=Callable[..., Any])
Types = tuple[Any, ...]
"""The types of a value, of which it must have one."""


def checked(public: Public) -> Public:
    """Decorator of a function, or of a dataclass: `InputError` with the name of an argument that is not of the type in its
    annotation, before anything is computed.

    A number is any real number; an array is whatever numpy makes an array of real numbers of; a list is any collection but text and
    mappings. Values are not converted, and their range is not checked. Keywords without an annotation are left to the function.
    """
    is_class = isinstance(public, type)
    made: Callable[..., Any] = public.__init__ if is_class else public
    names = tuple(signature(made).parameters)

    @wraps(made)
    def call(*arguments: Any, **named: Any) -> Any:
        types = _types(public)
        for name, value in (*zip(names, arguments, strict=False), *named.items()):
            if name in types and (wrong := mistake(value, types[name])):
                raise InputError(wrong, argument=name)
        return made(*arguments, **named)

    if not is_class:
        return typing.cast(Public, call)
    public.__init__ = call  # type: ignore[method-assign]
    return public


@cache
def _types(public: Callable[..., Any]) -> dict[str, Types]:
    """The types of each argument."""
    return {name: _alternatives(hint) for name, hint in typing.get_type_hints(public).items() if name != "return"}


def _alternatives(hint: Any) -> Types:
    """The types that a union joins, with `Floats` in the place of those of `ArrayLike`."""
    if get_origin(hint) not in (Union, UnionType):
        return (hint,)
    types = get_args(hint)
    return (Floats, *(other for other in types if other not in _LIKE_ARRAYS)) if {*types} >= _LIKE_ARRAYS else types


def mistake(value: Any, types: Types) -> str:
    """What is wrong with a value that has none of the types; empty if it has one."""
    # most values, at little cost
    is_array = type(value) is np.ndarray and value.dtype == np.float64
    if type(value) in types or ((is_array or type(value) is float) and Floats in types):
        return ""
    wrong = {kind: _mistake(value, kind) for kind in types}
    stated = [kind for kind in types if kind is not NoneType]
    return (wrong[stated[0]] if len(stated) == 1 else _needs(value, stated)) if all(wrong.values()) else ""


def _mistake(value: Any, kind: Any) -> str:
    """What is wrong with a value that is not of this type; empty if it is."""
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if kind in (float, int) or origin is np.ndarray:
        return _no_numbers(value, kind)
    entries: Iterable[tuple[Any, Any]] = ()
    if origin is Any or (inner and isinstance(value, Iterator)):  # whose entries can be read once only
        return ""
    if origin is Literal:
        fits = isinstance(value, str)
    elif inner and issubclass(origin, Mapping):
        fits = isinstance(value, Mapping)
        entries = ((entry, hint) for item in value.items() for entry, hint in zip(item, inner, strict=True)) if fits else ()
    elif inner and issubclass(origin, Iterable):
        fits = isinstance(value, Collection) and not isinstance(value, str | bytes | Mapping) and getattr(value, "ndim", 1) > 0
        pair = origin is tuple and Ellipsis not in inner
        fits = fits and not (pair and len(value) != len(inner))
        entries = zip(value, inner if pair else repeat(inner[0]), strict=False) if fits else ()
    else:
        fits = isinstance(value, bool | np.bool_ if kind is bool else origin)
    return (
        next(filter(None, (mistake(entry, _alternatives(hint)) for entry, hint in entries)), "") if fits else _needs(value, [kind])
    )


def _needs(value: Any, types: typing.Sequence[Any]) -> str:
    return f"{shown(value)}: {listed(dict.fromkeys(words for kind in types for words in _in_words(kind)))} is needed"


def _in_words(kind: Any) -> list[str]:
    """What a value of this type is, as in "a Material is needed"."""
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if origin in WORDS:
        return WORDS[origin][0].split(" or ") if origin is np.ndarray else [WORDS[origin][0]]
    if origin is Literal:
        return [f'"{choice}"' for choice in inner]
    if issubclass(origin, Mapping):
        return ["a dict"]
    if issubclass(origin, Iterable) and inner:
        kinds = [get_origin(entry) or entry for entry in _alternatives(inner[0]) if entry is not NoneType]
        entries = dict.fromkeys(WORDS[entry][1] if entry in WORDS else f"{entry.__name__}s" for entry in kinds)
        return [f"a {'list' if origin is not tuple or Ellipsis in inner else 'pair'} of {' or '.join(entries)}"]
    return [f"{'an' if origin.__name__[0] in 'AEIOU' else 'a'} {origin.__name__}"]


def _no_numbers(values: Any, kind: Any) -> str:
    """What is wrong with values that are no numbers of this type; empty if they are."""
    try:
        array = real_numbers(values)
    except InputError as error:
        return error.problems[0].text
    if kind not in (float, int):
        return ""
    if array.ndim:
        return f"an array of shape {array.shape}: one number is needed"
    return "" if kind is float or float(array).is_integer() else f"{float(array):g}: a whole number is needed"


def real_numbers(values: Any) -> Floats:
    """The values as an array of any shape; `InputError` for text, dates, durations, complex numbers, masked values, and all other
    values that are no array of numbers.
    """

    def needed() -> str:  # in words only where it is needed, as texts take longer than the check
        return f"{shown(values)}: a number in SI units, or a list of numbers, is needed"

    try:
        array = np.asanyarray(values)
        if array.dtype.kind == "O":
            if any(isinstance(value, str) for value in array.ravel()):
                raise TypeError
            array = np.array([float(value) for value in array.ravel()]).reshape(array.shape)
        if array.dtype.kind in NO_NUMBERS and array.size:
            raise InputError(f"{needed()}, not {NO_NUMBERS[array.dtype.kind]}")
        if np.any(getattr(array, "mask", False)):  # without an import of numpy.ma, which is slow
            raise InputError("some values are masked: leave them out, by their method compressed()")
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError) as error:
        raise (error if isinstance(error, InputError) else InputError(needed())) from None


def real_number(value: Any, name: str) -> float:
    """One number; `InputError` with the argument `name` for anything else."""
    if wrong := _no_numbers(value, float):
        raise InputError(wrong, argument=name)
    return float(real_numbers(value))
