"""The command line: a thin shell on the library. Nothing heavier than typer is imported before a command runs."""

import _signal  # type: ignore[import-not-found]  # built in: Ctrl-C while `signal` is loaded would be a traceback
import gc
import os
import sys


def main() -> None:
    """Run the command line: exit 0 done, 2 bad input, 3 the numerics gave up, 4 golden mismatch, 1 a bug, or `Leave.code`."""
    if _in_worker():
        return
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:  # a shell lets a job in the background ignore it
        _signal.signal(_signal.SIGINT, lambda number, _: os._exit(128 + number))  # before anything that takes time
    from dielast.cli.terminal import handle_signals, mend_streams, report_refusal

    handle_signals()
    mend_streams()
    gc.disable()  # until the modules of a run are loaded: loading makes no garbage, and is faster
    os.environ["MPLBACKEND"] = "agg"  # figures go to files; MPLBACKEND of a notebook would not load here
    for library in ("OPENBLAS", "OMP", "MKL"):  # matrices are small: threads cost more than they gain, and change the rounding
        os.environ[f"{library}_NUM_THREADS"] = "1"
    os.environ.pop("SOURCE_DATE_EPOCH", None)  # figures hold no dates, and matplotlib stops at one that is no whole number
    os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"  # the search for them takes half as long as loading pydantic
    from dielast.base.errors import InputError
    from dielast.cli.app import application
    from dielast.cli.help import UsageError, report_usage

    try:
        code = application(sys.argv[1] if len(sys.argv) > 1 else None)(prog_name="dielast", standalone_mode=False)
    except InputError as error:  # of an installed package that has the command
        print(error, file=sys.stderr)
        code = 2
    except UsageError as error:
        code = report_usage(error)
    except OSError as error:  # from printing the help or the version; commands report such errors themselves
        code = report_refusal(error)
    sys.exit(code)


def _in_worker() -> bool:
    """Whether this is a starting worker process: it imports the script that runs `main`, perhaps at its top level."""
    processes = sys.modules.get("multiprocessing.process")
    return processes is not None and getattr(processes.current_process(), "_inheriting", False)
