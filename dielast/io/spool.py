"""What is too long for the memory lies in temporary files without a name, which end with this process."""

from __future__ import annotations

import hashlib
import itertools
import os
import tempfile
import weakref
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any

from dielast.base.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

IN_MEMORY = 32 << 20  # bytes of a file to be written, or of the numbers of a run, that are held in memory
PIECE = 1 << 20  # bytes that are copied at a time


class Spooled:
    """The content of a file that is too long for the memory, in a temporary file without a name."""

    def __init__(self, pieces: Iterable[bytes]) -> None:
        """Take all pieces; raises `InputError` if the folder of temporary files is full, or if there is none."""
        digest = hashlib.sha256()
        try:
            self._file = tempfile.TemporaryFile()  # noqa: SIM115, it is closed with this object
            for piece in pieces:
                digest.update(piece)
                self._file.write(piece)
            self._file.flush()
        except OSError as error:
            raise _refused(error) from None
        self.sha256 = digest.hexdigest()

    def __iter__(self) -> Iterator[bytes]:
        self._file.seek(0)
        while piece := self._file.read(PIECE):
            yield piece

    def __bytes__(self) -> bytes:
        return b"".join(self)


Content = bytes | Spooled
"""The content of a file to be written."""


def content_of(pieces: Iterable[bytes]) -> Content:
    """The content in these pieces, in memory if it is short."""
    pieces, first = iter(pieces), list[bytes]()
    while sum(map(len, first)) <= IN_MEMORY:
        if (piece := next(pieces, None)) is None:
            return b"".join(first)
        first.append(piece)
    return Spooled(itertools.chain(first, pieces))


class Spool:
    """Holds the arrays of a run: the first ones in memory, and what is beyond `IN_MEMORY` in a temporary file."""

    def __init__(self) -> None:
        """Hold nothing yet."""
        self._held = self._end = 0
        self._file: IO[bytes] | None = None

    def put(self, numbers: Floats) -> Floats | Away:
        """The array (rows, n) itself, or its place in the file; raises `InputError` if the folder of temporary files is full."""
        if self._file is None and self._held + numbers.nbytes <= IN_MEMORY:
            self._held += numbers.nbytes
            return numbers
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile()  # noqa: SIM115, it is closed with this object
                weakref.finalize(self, self._file.close)
            self._file.seek(self._end)
            self._file.write(numbers.tobytes())
            self._file.flush()  # a full disk is refused here
        except OSError as error:
            raise _refused(error) from None
        place = Away(self, self._end, numbers.shape)
        self._end += numbers.nbytes
        return place

    def read(self, begin: int, count: int) -> Floats:
        """So many numbers of the file, from a byte on."""
        import numpy as np  # imported here, as every command imports this module, also without arrays

        assert self._file is not None
        self._file.seek(begin)
        return np.frombuffer(self._file.read(8 * count), dtype=float)


@dataclass(frozen=True, slots=True, eq=False)
class Away:
    """An array (rows, n) in the file of a spool, where it begins at the byte `begin`."""

    spool: Spool
    begin: int
    shape: tuple[int, ...]

    def __getitem__(self, row: int) -> Floats:
        """The numbers (n,) of a row."""
        return self.spool.read(self.begin + 8 * row * self.shape[1], self.shape[1])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Floats:
        return self.spool.read(self.begin, self.shape[0] * self.shape[1]).reshape(self.shape)


def _refused(error: OSError) -> InputError:
    """What is wrong with the folder of temporary files."""
    # without any usable folder, gettempdir() would fail too, and the error lists all that were tried
    where = tempfile.tempdir
    reason = (error.strerror or str(error)).lower() if where else "no usable folder"
    return InputError(
        f"cannot write a temporary file: {reason}; set TMPDIR to a folder with room", file=where and os.fsdecode(where)
    )
