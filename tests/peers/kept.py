"""Answers of peers, kept in tests/references/peers.json, since tests against a peer spent most of their time in the peer.

`Run`, `DiscRun`, `fold` and `squeeze` stand for those of membrane.py and disc.py. Each result has a key of its question: the text
of tests/peers, and films, loads, tolerances and times, where functions count by their text and by all values that they use. A
question that is not kept is put to the peer, which is only slower. `pytest tests/physics --update-golden` puts all of them again
and keeps the answers; with DIELAST_PEERS=compare in the environment, the answers must be those that are kept
(tests/trust/test_peers_kept.py).
"""

from __future__ import annotations

import base64
import fcntl
import inspect
import json
import os
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from peers import disc, membrane
from scipy.sparse import csr_array

FOLDER = Path(__file__).parent
KEPT = FOLDER.parent / "references" / "peers.json"
MODE = os.environ.get("DIELAST_PEERS")  # "compare" or "keep": the peers are asked in any case
AGREES = 1e-9  # of the largest of an array: the same peer on another machine
TYPES = {kind.__name__: kind for kind in (membrane.History, membrane.State, disc.Fields, disc.Moment)}
answers: dict[str, Any] = {}
"""What was computed in this process, by key; `keep` writes it."""


def keep() -> None:
    """Add what was computed to the file, whatever other processes of the tests do."""
    if answers:
        with KEPT.open("a+") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            file.seek(0)
            whole = json.loads(file.read() or "{}") | answers
            file.truncate(0)
            lines = (f'"{key}": {json.dumps(value)}' for key, value in sorted(whole.items()))
            file.write("{\n" + ",\n".join(lines) + "\n}\n")
            file.flush()


@cache
def _kept() -> dict[str, Any]:
    return dict(json.loads(KEPT.read_text())) if KEPT.exists() else {}


@cache
def _peers() -> str:
    text = b"".join(path.read_bytes() for path in sorted(FOLDER.glob("*.py")) if path.name != "kept.py")
    return sha256(text).hexdigest()


def in_json(value: Any, within: tuple[FunctionType, ...] = ()) -> Any:
    """A value in terms of JSON, the same for the same question: numbers have twelve digits, on which all machines agree."""
    if isinstance(value, bool | str | int | None):
        return value
    if isinstance(value, float | np.floating):
        return f"{value:.11e}"
    if isinstance(value, csr_array):
        value = value.toarray()
    if isinstance(value, np.ndarray):
        return [list(value.shape), [in_json(each) for each in value.ravel().tolist()]]
    if isinstance(value, list | tuple):
        return [in_json(each, within) for each in value]
    if isinstance(value, dict):
        return {str(key): in_json(each, within) for key, each in sorted(value.items())}
    if isinstance(value, FunctionType):
        return value.__qualname__ if value in within else _function(value, within)
    if isinstance(value, ModuleType | type | BuiltinFunctionType | np.ufunc):
        return value.__name__
    assert is_dataclass(value), value
    return [type(value).__name__, {field.name: in_json(getattr(value, field.name), within) for field in fields(value)}]


def _function(function: FunctionType, within: tuple[FunctionType, ...]) -> Any:
    code, known = function.__code__, function.__globals__
    own = [function.__qualname__, function.__defaults__, [cell.cell_contents for cell in function.__closure__ or ()]]
    if function.__module__.partition(".")[0] not in ("peers", "numpy", "scipy"):  # the text of peers is in every key
        names = sorted({name for each in _codes(code) for name in each.co_names if name in known})
        # two functions of one line differ by their numbers
        constants = [[one for one in each.co_consts if isinstance(one, float)] for each in _codes(code)]
        own += [inspect.getsource(function), constants, [known[name] for name in names]]
    return in_json(own, (*within, function))


def _codes(code: CodeType) -> list[CodeType]:
    return [code, *(inner for each in code.co_consts if isinstance(each, CodeType) for inner in _codes(each))]


def _packed(value: Any) -> Any:
    """A result in terms of JSON: arrays are their bytes."""
    if isinstance(value, np.ndarray):
        return {"shape": value.shape, "bytes": base64.b64encode(np.asarray(value, "<f8").tobytes()).decode()}
    if is_dataclass(value):
        return {"type": type(value).__name__, **{field.name: _packed(getattr(value, field.name)) for field in fields(value)}}
    return [_packed(each) for each in value] if isinstance(value, list | tuple) else float(value)


def _unpacked(value: Any) -> Any:
    if not isinstance(value, dict):
        return [_unpacked(each) for each in value] if isinstance(value, list) else value
    if "bytes" in value:
        return np.frombuffer(base64.b64decode(value["bytes"]), "<f8").reshape(value["shape"]).copy()
    return TYPES[value["type"]](**{name: _unpacked(each) for name, each in value.items() if name != "type"})


def _assert_same(one: Any, other: Any) -> None:
    if is_dataclass(one):
        for field in fields(one):
            _assert_same(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, list | tuple):
        for first, second in zip(one, other, strict=True):
            _assert_same(first, second)
    else:
        one, other = np.asarray(one), np.asarray(other)
        np.testing.assert_allclose(one, other, rtol=AGREES, atol=AGREES * np.max(np.abs(other), initial=0.0))


def answer(question: Any, compute: Callable[[], Any]) -> Any:
    """What is kept of a question, or else what is computed."""
    key = sha256(json.dumps([_peers(), in_json(question)]).encode()).hexdigest()[:20]
    kept = _kept().get(key)
    if kept is None or MODE:
        computed = compute()
        if kept is not None and MODE == "compare":
            _assert_same(computed, _unpacked(kept))
        answers[key] = _packed(computed)
        return computed
    return _unpacked(kept)


class _Asked:
    """A run of a peer that is computed when something is asked of it that is not kept."""

    solve: type

    def __init__(self, *given: Any, **more: Any) -> None:
        self.given, self.more = given, more
        self.question = in_json([self.solve.__name__, given, more])

    @cached_property
    def run(self) -> Any:
        return self.solve(*self.given, **self.more)

    @property
    def final(self) -> Any:
        return answer([self.question, "final"], lambda: self.run.final)

    def __getattr__(self, name: str) -> Any:
        """A method of the run with its answers kept, such as `at`; what is no method is that of the run."""
        if not callable(getattr(self.solve, name, None)):
            return getattr(self.run, name)
        return lambda *given: answer([self.question, name, given], lambda: getattr(self.run, name)(*given))


class Run(_Asked):
    """`membrane.Run`."""

    solve = membrane.Run


class DiscRun(_Asked):
    """`disc.DiscRun`."""

    solve = disc.DiscRun


def fold(*given: Any, **more: Any) -> membrane.State:
    """`membrane.fold`."""
    result: membrane.State = answer(["fold", given, more], lambda: membrane.fold(*given, **more))
    return result


def squeeze(*given: Any) -> float:
    """eps e^2 in Pa that `disc.shoot` finds."""
    return float(answer(["squeeze", given], lambda: disc.shoot(*given)[0]))
