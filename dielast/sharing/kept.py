"""What a study keeps of its results in a file, so that an interrupted run can go on from there."""

from __future__ import annotations

import hashlib
import io
import itertools
import os
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from dielast import __version__
from dielast.base.registry import adopted
from dielast.sharing.execution import Chunk

if TYPE_CHECKING:
    from dielast.io.files import Inputs
    from dielast.recipe.cases import Case

VERSIONS = {"dielast": __version__, "numpy": np.__version__}
"""The versions on which results may depend: workers of a cluster and an interrupted run must share them."""
CHANGED = "the {} {} of an interrupted run are discarded: the recipe, a file that it names, or dielast has changed since"
UNREADABLE = "an interrupted run is discarded: its file is damaged, or of another version of dielast"
DIGEST = 32  # bytes at the end of the file
LARGEST = 1 << 30  # bytes of all that is before
PIECE = 1 << 20  # bytes that are read at a time
_OF_ARRAYS = {"_frombuffer", "_reconstruct", "ndarray", "dtype", "scalar"}
"""The names of numpy that a pickle of arrays holds."""


@dataclass(slots=True)
class Kept:
    """The `results` by stage, as named by what is counted, and chunk; and the pickled `states` of simulations under way, by stage,
    chunk and the number of the simulation in the chunk.
    """

    results: dict[str, dict[Chunk, Any]] = field(default_factory=dict)
    states: dict[tuple[str, Chunk, int], bytes] = field(default_factory=dict)

    def pieces(self, key: str) -> Iterator[bytes]:
        """The content of a file that keeps this under a key: each result by itself, so that the file may be larger than what is
        pickled at a time, and a digest at the end. Raises `Overfull` beyond `LARGEST` bytes.
        """
        count = {many: size(outermost(results)) for many, results in self.results.items() if results}
        places = [(many, chunk) for many, results in self.results.items() for chunk in results]
        head = key, count, self.states, [*self.results], places
        digest, written = hashlib.sha256(), 0
        for part in itertools.chain([head], (self.results[many][chunk] for many, chunk in places)):
            piece = pickle.dumps(part, protocol=5)
            digest.update(piece)
            written += len(piece)
            if written > LARGEST:
                raise Overfull
            yield piece
        yield digest.digest()


class Overfull(Exception):
    """More is to be kept than a file may hold."""


def load(store: Path, key: str, held: Callable[[Any], Any] = lambda solved: solved) -> tuple[Kept, str]:
    """What an earlier run has kept in a file under the `key`, each result as it is `held`; and why it is discarded, empty if it is
    not.
    """
    try:
        with store.open("rb") as file:
            left = os.fstat(file.fileno()).st_size - DIGEST
            if left > LARGEST or not _is_whole(file, left):
                return Kept(), UNREADABLE
            file.seek(0)
            known, count, states, stages, places = _Unpickler(file).load()
            if known != key:
                return Kept(), "; ".join(CHANGED.format(number, many) for many, number in count.items())
            results: dict[str, dict[Chunk, Any]] = {many: {} for many in stages}
            for many, chunk in places:
                results[many][chunk] = held(_Unpickler(file).load())
        return Kept(results, states), ""
    except Exception:  # of another version, which may have other classes
        return Kept(), UNREADABLE


def _is_whole(file: IO[bytes], left: int) -> bool:
    """Whether so many bytes of a file have the digest that follows."""
    digest = hashlib.sha256()
    while left > 0 and (piece := file.read(min(left, PIECE))):
        digest.update(piece)
        left -= len(piece)
    return file.read() == digest.digest()


def restored(content: bytes | memoryview) -> Any:
    """What was pickled, of nothing but arrays and objects of dielast; raises whatever pickle raises."""
    return _Unpickler(io.BytesIO(content)).load()


def fingerprint(cases: Sequence[Case[Any]], inputs: Inputs) -> str:
    """A digest of the versions, recipe and inputs, which an unfinished run must share with this run to be resumed."""
    recipe = cases[0].recipe
    # stating the default of a key may have an effect; other cases differ from the first by their settings alone
    settings = [(case.settings, case.of_material) for case in cases]
    stated = (
        f"{VERSIONS}{adopted() or ''}\n{recipe!r}\n{recipe.model_dump(exclude_unset=True)}\n{settings!r}\n{sorted(inputs.digests)}"
    )
    return hashlib.sha256(stated.encode()).hexdigest()


class _Unpickler(pickle.Unpickler):
    """Makes arrays and objects of dielast, and calls nothing else: a folder of results may come from anybody."""

    def find_class(self, module: str, name: str) -> Any:
        """The class or function of this name; raises `UnpicklingError` for all that no result is made of."""
        if module.split(".")[0] in ("dielast", "numpy"):
            found = super().find_class(module, name)
            # a module of dielast also holds what it imports, such as subprocess.Popen
            own = isinstance(found, type) and found.__module__.split(".")[0] == "dielast"
            if name in _OF_ARRAYS if module.startswith("numpy") else own:
                return found
        raise pickle.UnpicklingError(name)


def size(chunks: Iterable[Chunk]) -> int:
    """How many cases the chunks have."""
    return sum(end - first for first, end in chunks)


def outermost(kept: Mapping[Chunk, Any]) -> list[Chunk]:
    """The chunks in their order, without those that lie within others."""
    chunks: list[Chunk] = []
    for first, end in sorted(kept, key=lambda chunk: (chunk[0], -chunk[1])):
        if not chunks or end > chunks[-1][1]:
            chunks.append((first, end))
    return chunks
