"""Available memory; a run that needs more is refused before it begins."""

import os
from collections.abc import Iterator
from contextlib import suppress
from math import inf
from pathlib import Path

from dielast.base.errors import NumericsError

OUT_OF_MEMORY = "out of memory: state fewer cases, cells, rows or draws"


def available_memory() -> float:
    """Bytes that this process may still allocate: the least of the free memory and what is left of its address space (`ulimit -v`)
    and its control group; infinite if the system reports none of them.
    """
    return min(_limits(), default=inf)


def check_memory(needed: float, what: str, less: str) -> None:
    """Raise `NumericsError` if `what` needs more bytes than are free; `less` is advice on how to need less."""
    free = available_memory()
    if needed > free:
        raise NumericsError(f"{what} need about {_size(needed)} of memory, and {_size(free)} are free: {less}")


def _limits() -> Iterator[float]:
    with suppress(OSError, ValueError):
        lines = Path("/proc/meminfo").read_text().splitlines()
        yield from (1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        yield float(int((group / "memory.max").read_text()) - int((group / "memory.current").read_text()))
    with suppress(OSError, ValueError, ImportError, AttributeError):
        import resource  # not on every system

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
            yield max(float(limit - used), 0.0)
    with suppress(OSError, ValueError, AttributeError):  # the total memory, if the free memory is unknown
        yield float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))


def _size(count: float) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB"
