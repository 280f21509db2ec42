"""A process that has dielast and its libraries loaded, and runs command lines, each in a fork of its own.

A fork starts in milliseconds, Python with all that a command loads in more than a second. A request is a line of JSON on standard
input: arguments, folder, environment, code to run before (`prelude`), and the files for standard output and standard error. The
answer is the exit code, on a line of standard output.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import pkgutil
import sys
import threading
import traceback
from importlib import import_module
from typing import Any


def serve() -> dict[str, Any] | None:
    """Fork for every request until standard input ends; the fork returns its request, the server None."""
    for line in iter(sys.stdin.readline, ""):
        request: dict[str, Any] = json.loads(line)
        child = os.fork()
        if child == 0:
            return request
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
    return None


def become(request: dict[str, Any]) -> None:
    """Take on what is asked for, as a program that a user starts has it."""
    for descriptor, name, flags in (
        (0, os.devnull, os.O_RDONLY),
        (1, request["stdout"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC),
        (2, request["stderr"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC),
    ):
        os.dup2(os.open(name, flags), descriptor)
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.argv = ["-c", *request["arguments"]]


if __name__ == "__main__":
    import dielast

    for module in pkgutil.walk_packages(dielast.__path__, "dielast."):
        import_module(module.name)
    for name in ("matplotlib.backends.backend_agg", "matplotlib.font_manager", "rich.progress", "scipy.optimize"):
        import_module(name)
    gc.freeze()
    asked = serve()
    if asked is not None:
        code: object = 1
        try:
            become(asked)
            exec(asked["prelude"])
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
