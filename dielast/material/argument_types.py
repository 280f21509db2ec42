"""Types of arguments: a public function, or a class that users make, refuses a value that its annotation does not allow."""

import typing
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import cache, wraps
from inspect import signature
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, shown
from dielast.numerics.arrays import Floats

IN_WORDS: dict[Any, str] = {
    float: "a number in SI units",
    int: "a whole number",
    bool: "True or False",
    str: "text",
    Callable: "a function",
}
ENTRIES: dict[Any, str] = {float: "numbers", int: "whole numbers", str: "names", np.ndarray: "numbers"}
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
            if name in types:
                check(value, types[name], name)
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
    if not {*types} >= _LIKE_ARRAYS:
        return types
    return Floats, *(other for other in types if other not in _LIKE_ARRAYS)


def check(value: Any, types: Types, name: str) -> None:
    """`InputError` with the argument `name` unless the value has one of the types."""
    # most values, at little cost
    is_array = type(value) is np.ndarray and value.dtype == np.float64
    if type(value) in types or ((is_array or type(value) is float) and Floats in types):
        return
    reason = None
    for kind in types:
        try:
            _check(value, kind, name)
        except InputError as error:
            reason = error if kind is not NoneType else reason
        else:
            return
    several = [kind for kind in types if kind is not NoneType]
    raise reason if len(several) == 1 and reason is not None else _refused(value, several, name)


def _check(value: Any, kind: Any, name: str) -> None:
    """`InputError` with the argument `name` unless the value has this type."""
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if kind is float:
        real_number(value, name)
    elif kind is int:
        whole_number(value, name)
    elif origin is np.ndarray:
        real_numbers(value, name)
    elif origin is Literal:
        _need(isinstance(value, str), value, kind, name)
    elif origin is Callable:
        _need(callable(value), value, kind, name)
    elif kind is bool:
        _need(isinstance(value, bool | np.bool_), value, kind, name)
    elif not isinstance(origin, type):  # Any
        return
    elif issubclass(origin, Mapping) and inner:
        _need(isinstance(value, Mapping), value, kind, name)
        for key, entry in value.items():
            check(key, _alternatives(inner[0]), name)
            check(entry, _alternatives(inner[1]), name)
    elif issubclass(origin, Iterable) and inner:
        if isinstance(value, Iterator):  # its entries can be read once only
            return
        listed = isinstance(value, Collection) and not isinstance(value, str | bytes | Mapping) and getattr(value, "ndim", 1) > 0
        _need(listed, value, kind, name)
        repeated = origin is not tuple or Ellipsis in inner
        _need(repeated or len(value) == len(inner), value, kind, name)
        for k, entry in enumerate(value):
            check(entry, _alternatives(inner[0 if repeated else k]), name)
    else:
        _need(isinstance(value, origin), value, kind, name)


def _need(fits: bool, value: Any, kind: Any, name: str) -> None:
    if not fits:
        raise _refused(value, [kind], name)


def _refused(value: Any, types: typing.Sequence[Any], name: str) -> InputError:
    *others, last = dict.fromkeys(words for kind in types for words in _in_words(kind))
    needed = f"{', '.join(others)} or {last}" if others else last
    return InputError(f"{shown(value)}: {needed} is needed", argument=name)


def _in_words(kind: Any) -> list[str]:
    """What a value of this type is, as in "a Material is needed"."""
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if origin in IN_WORDS:
        return [IN_WORDS[origin]]
    if origin is np.ndarray:
        return ["a number in SI units", "a list of numbers"]
    if origin is Literal:
        return [f'"{choice}"' for choice in inner]
    if issubclass(origin, Mapping):
        return ["a dict"]
    if issubclass(origin, Iterable) and inner:
        kinds = [entry for entry in _alternatives(inner[0]) if entry is not NoneType]
        entries = [ENTRIES.get(get_origin(entry) or entry) or entry.__name__ + "s" for entry in kinds]
        listed = "list" if origin is not tuple or Ellipsis in inner else "pair"
        return [f"a {listed} of {' or '.join(dict.fromkeys(entries))}"]
    return [f"{'an' if origin.__name__[0] in 'AEIOU' else 'a'} {origin.__name__}"]


def real_numbers(values: Any, name: str) -> Floats:
    """The values as an array of any shape; `InputError` with the argument `name` for text, dates, durations, complex numbers,
    masked values, and all other values that are no array of numbers.
    """
    needed = "a number in SI units, or a list of numbers, is needed"
    try:
        array = np.asanyarray(values)
        if array.dtype.kind == "O":
            if any(isinstance(value, str) for value in array.ravel()):
                raise TypeError
            array = np.array([float(value) for value in array.ravel()]).reshape(array.shape)
        if array.dtype.kind in NO_NUMBERS and array.size:
            raise InputError(f"{shown(values)}: {needed}, not {NO_NUMBERS[array.dtype.kind]}", argument=name)
        if np.any(getattr(array, "mask", False)):  # without an import of numpy.ma, which is slow
            raise InputError(f"some values are masked: leave them out ({name}.compressed())", argument=name)
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{shown(values)}: {needed}", argument=name) from None


def real_number(value: Any, name: str) -> float:
    """One number; `InputError` with the argument `name` as in `real_numbers`, and for several numbers."""
    array = real_numbers(value, name)
    if array.ndim:
        raise InputError(f"an array of shape {array.shape}: one number is needed", argument=name)
    return float(array)


def whole_number(value: Any, name: str) -> int:
    """One whole number; `InputError` with the argument `name` as in `real_number`, and for a fraction."""
    number = real_number(value, name)
    if not number.is_integer():
        raise InputError(f"{number:g}: a whole number is needed", argument=name)
    return int(number)
