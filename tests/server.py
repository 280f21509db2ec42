"""A process that has dielast and its libraries loaded and ready, and runs command lines, each in a fork of its own.

A fork starts in milliseconds, Python with all that a command loads in about a second. Requests come from client.py through a socket
that listens already: three descriptors (standard streams), then JSON with arguments, folder, environment and code to run before
(`prelude`). The answer is the exit code. The process ends with its standard input.
"""

from __future__ import annotations

import atexit
import gc
import io
import json
import os
import pkgutil
import select
import socket
import sys
import threading
import traceback
from importlib import import_module
from typing import Any

# what libraries and dielast import when they are used
LATE = (
    *("encodings.utf_8_sig", "pydantic.type_adapter", "resource", "rich.progress"),
    *("scipy.optimize", "scipy.stats", "tomli_w", "typer._adapters"),
)
Request = tuple[dict[str, Any], list[int]]  # what client.py sends, and three descriptors


def serve(listener: socket.socket) -> Request | None:
    """Fork for every request until standard input ends; the fork returns its request, the server None."""
    while listener in select.select([listener, sys.stdin], [], [])[0]:
        line, _ = listener.accept()
        with line:
            _, streams, _, _ = socket.recv_fds(line, 1, 3)
            with line.makefile("rb") as rest:
                request = json.load(rest)
            child = os.fork()
            if child == 0:
                listener.close()
                return request, streams
            for stream in streams:
                os.close(stream)
            line.sendall(str(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])).encode())
    return None


def become(request: dict[str, Any], streams: list[int]) -> None:
    """Take on what is asked for, as a program that a user starts has it."""
    for descriptor, stream in enumerate(streams):
        os.dup2(stream, descriptor)
        os.close(stream)
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.argv = ["-c", *request["arguments"]]


def load() -> None:
    """Import whatever a command may import, and make what it makes on first use: models of recipes, fonts and a first figure."""
    import dielast

    for module in pkgutil.walk_packages(dielast.__path__, "dielast."):
        import_module(module.name)
    for name in LATE:
        import_module(name)
    from dielast.base.registry import adopt
    from dielast.commands.registry import COMMANDS
    from dielast.handover.material_file import material_file
    from dielast.plots.style import panels, style

    for model in (*(command.model for command in COMMANDS.values()), material_file()):
        model.model_rebuild()
    adopt("what no package has")  # which looks up what all of them have
    with style():
        figure, (axes,) = panels(1, "")
        axes.loglog([1.0, 1e9], [1.0, 1e9])
        figure.savefig(io.BytesIO(), format="png")
    gc.freeze()


if __name__ == "__main__":
    load()
    asked = serve(socket.socket(fileno=int(sys.argv[1])))
    if asked is not None:
        code: object = 1
        try:
            become(*asked)
            exec(asked[0]["prelude"])
            import_module("dielast.cli").main()
        except SystemExit as end:
            code = end.code
        except BaseException:
            traceback.print_exc()
        threading._shutdown()
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(
            code if isinstance(code, int) else int(code is not None)
        )  # without taking apart every module, which takes longer than a command
