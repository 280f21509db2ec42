"""What a study keeps of its results in a file, so that an interrupted run can go on from there."""

from __future__ import annotations

import hashlib
import io
import pickle
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
DIGEST = 32  # bytes at the beginning of the file
LARGEST = 1 << 30  # bytes of the file, which is read into memory as a whole
_OF_ARRAYS = {"_frombuffer", "_reconstruct", "ndarray", "dtype", "scalar"}
"""The names of numpy that a pickle of arrays holds."""


@dataclass(slots=True)
class Kept:
    """The `results` by stage, as named by what is counted, and chunk; and the pickled `states` of simulations under way, by stage,
    chunk and the number of the simulation in the chunk.
    """

    results: dict[str, dict[Chunk, Any]] = field(default_factory=dict)
    states: dict[tuple[str, Chunk, int], bytes] = field(default_factory=dict)

    def packed(self, key: str) -> bytes:
        """The content of a file that keeps this under a key."""
        count = {many: size(outermost(results)) for many, results in self.results.items() if results}
        content = io.BytesIO(bytes(DIGEST))  # no second copy: it may be of LARGEST
        content.seek(DIGEST)
        pickle.dump((key, count, self.results, self.states), content, protocol=5)
        with content.getbuffer() as whole:
            whole[:DIGEST] = hashlib.sha256(whole[DIGEST:]).digest()
        return content.getvalue()


def load(store: Path, key: str) -> tuple[Kept, str]:
    """What an earlier run has kept in a file under the `key`; and why it is discarded, empty if it is not."""
    try:
        if store.stat().st_size > LARGEST:
            return Kept(), UNREADABLE
        content = memoryview(store.read_bytes())
        if hashlib.sha256(content[DIGEST:]).digest() != content[:DIGEST]:
            return Kept(), UNREADABLE
        known, count, results, states = restored(content[DIGEST:])
        if known == key:
            return Kept(results, states), ""
        return Kept(), "; ".join(CHANGED.format(number, many) for many, number in count.items())
    except Exception:  # of another version, which may have other classes
        return Kept(), UNREADABLE


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
