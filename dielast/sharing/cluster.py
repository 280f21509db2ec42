"""Solve the chunks of a plan on a Dask cluster, for any plan with independent chunks.

The plan is sent to each worker once. Dask gives the chunks of a lost worker to another worker.
"""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dielast.base.errors import InputError, and_more
from dielast.base.registry import adopt, adopted
from dielast.sharing.execution import Chunk, Plan, Solve, Solved
from dielast.sharing.kept import VERSIONS

if TYPE_CHECKING:
    from distributed import Client

RETRIES = 2  # of a chunk that raises an error; the scheduler sets how many workers may die over a chunk
PAUSE = 0.05  # s between two looks for finished chunks
LONGEST_SILENCE = 10.0  # s until a scheduler answers which kind of node it is, or how many workers it has


class OtherVersion(RuntimeError):
    """A worker has a different version of dielast or numpy than this process."""


def solve_on(scheduler: str, solve: Solve[Plan, Solved], plan: Plan, chunks: Sequence[Chunk]) -> Iterator[Solved]:
    """`solve(plan, first, end)` of each chunk, in the order in which the cluster finishes them.

    `scheduler` is the address of a Dask scheduler, such as tcp://host:8786, or its scheduler file, NAME.json. `solve` is a
    function of a module. Raises `InputError`, in a line that starts with `scheduler`, if the cluster is not reached, has no workers
    or other versions of dielast or numpy, or is lost during the run.
    """
    try:
        import distributed
    except ImportError:
        raise InputError("a scheduler needs Dask, which is not installed: pip install 'dielast[cluster]'", file=scheduler) from None
    patience = _patience()
    silence = min(patience, LONGEST_SILENCE)
    with _connected(scheduler, silence) as client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise InputError(f"the scheduler has no workers, after {patience:g} s of waiting", file=scheduler) from None
        _check_versions(scheduler, client)
        # the plan is a task and not scattered data: Dask can repeat it when the worker that holds it is lost
        held = client.submit(_held, plan, pure=False)
        first, end = zip(*chunks, strict=True)
        futures = client.map(
            _solve_there, first, end, pure=False, retries=RETRIES, solve=solve, plan=held, versions=VERSIONS, packages=adopted()
        )
        try:
            ready = distributed.as_completed(futures, loop=client.loop)
            last = time.monotonic()
            while not ready.is_empty():
                if batch := ready.next_batch(block=False):
                    yield from client.gather(batch)
                    last = time.monotonic()
                elif time.monotonic() - last > patience:
                    if not client.sync(client.scheduler.ncores, callback_timeout=silence):
                        raise InputError("all workers are gone", file=scheduler)
                    last = time.monotonic()
                else:
                    time.sleep(PAUSE)
        except distributed.KilledWorker as error:
            lost = f"{error.allowed_failures + 1} workers" if error.allowed_failures else "a worker"
            raise InputError(f"{lost} died while solving the same cells, perhaps for lack of memory", file=scheduler) from None
        except (RuntimeError, ImportError) as error:
            if not isinstance(error, OtherVersion | ImportError) and not isinstance(error.__cause__, ImportError):
                raise
            reason = error.__cause__ or error
            raise InputError(f"not every worker has this dielast: {reason}", file=scheduler) from None
        except (CancelledError, OSError):
            raise InputError("the scheduler was lost", file=scheduler) from None
        finally:
            if client.status == "running":
                client.cancel(futures)


@contextmanager
def _connected(scheduler: str, silence: float) -> Iterator[Client]:
    import distributed

    address = _address(scheduler)
    if address.startswith("inproc:"):
        raise InputError("an address within another process cannot be reached; write one such as tcp://host:8786", file=scheduler)
    # Dask logs lost connections on standard error; an `InputError` reports them in one line instead
    logging.disable(logging.CRITICAL)
    try:
        try:
            # asked first, because the threads of a client without a scheduler print messages
            kind = asyncio.run(asyncio.wait_for(_kind(address), silence))
        except OSError:
            raise InputError(f"no Dask scheduler answers at this address within {silence:g} s", file=scheduler) from None
        except (ValueError, TypeError, RuntimeError) as error:
            reason = "Dask lacks what this kind of address needs" if "abstract class" in str(error) else str(error)
            raise InputError(f"no Dask scheduler can be reached at this address: {reason}", file=scheduler) from None
        except Exception:  # what another program answers may be taken for a message of any length and kind
            raise InputError("what answers at this address is no Dask scheduler", file=scheduler) from None
        if kind != "Scheduler":
            raise InputError(f"the address is that of a Dask {kind.lower()}; that of a scheduler is needed", file=scheduler)
        with distributed.Client(address, set_as_default=False) as client:
            yield client
    finally:
        logging.disable(logging.NOTSET)


async def _kind(address: str) -> str:
    """The kind of Dask node at this address, such as "Scheduler"."""
    from distributed.core import rpc
    from distributed.security import Security

    async with rpc(address, connection_args=Security().get_connection_args("client")) as there:
        return str((await there.identity())["type"])


def _address(scheduler: str) -> str:
    if not scheduler.endswith(".json"):
        return scheduler
    try:
        return str(json.loads(Path(scheduler).read_bytes())["address"])
    except OSError as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else (error.strerror or "cannot be read").lower()
        raise InputError(reason, file=scheduler) from None
    except (ValueError, KeyError, TypeError):
        raise InputError("not the file that a Dask scheduler writes (dask scheduler --scheduler-file)", file=scheduler) from None


def _patience() -> float:
    """The time in s for which Dask waits for a connection (its setting `distributed.comm.timeouts.connect`)."""
    import dask
    from dask.utils import parse_timedelta

    return float(parse_timedelta(dask.config.get("distributed.comm.timeouts.connect")))


def _check_versions(scheduler: str, client: Client) -> None:
    versions: dict[str, Any] = client.get_versions(packages=list(VERSIONS))
    here = versions["client"]["packages"]
    # the scheduler unpickles tasks as well
    nodes = {"the scheduler itself": versions["scheduler"]} | {f"worker {name}": node for name, node in versions["workers"].items()}
    differences = {name: _differing(here, node["packages"]) for name, node in nodes.items()}
    lines = [f"{name}: {other}" for name, other in differences.items() if other]
    if lines:
        raise InputError(f"{lines[0]}{and_more(len(lines) - 1)}", file=scheduler)


def _differing(needed: Mapping[str, str | None], installed: Mapping[str, str | None]) -> str:
    """A text on the packages whose version is not the `needed` one; empty if all versions agree."""
    differing = [name for name in VERSIONS if needed[name] != installed[name]]
    return ", ".join(f"{name} {needed[name]} is needed, {installed[name] or 'none'} is installed" for name in differing)


def _held(plan: Plan) -> Plan:
    return plan


def _solve_there(
    first: int,
    end: int,
    *,
    solve: Solve[Plan, Solved],
    plan: Plan,
    versions: Mapping[str, str],
    packages: Sequence[tuple[str, str, str]],
) -> Solved:
    """Solve a chunk on a worker; versions are checked here as well, as a worker may have joined after the first check."""
    if other := _differing(versions, VERSIONS):
        raise OtherVersion(other)
    for group, name, _ in packages:
        adopt(name, group)
    return solve(plan, first, end)
