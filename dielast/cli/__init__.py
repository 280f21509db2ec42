"""The command line: a thin shell on the library. Nothing heavier than typer is imported before a command runs."""

from __future__ import annotations

import os
import signal
import sys

from dielast.cli.interrupt import leave
from dielast.cli.streams import mend_streams, tell_refusal


def main() -> None:
    """Run the command line: exit 0 done, 2 bad input, 3 the numerics gave up, 4 golden mismatch, 130 interrupted, 1 a bug."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not if Ctrl-C is ignored, as in the background
        signal.signal(signal.SIGINT, leave)
    mend_streams()
    os.environ["MPLBACKEND"] = "agg"  # files are all that is drawn, and a notebook's own would not load here
    from dielast.cli.app import app
    from dielast.cli.help import UsageError, tell_usage

    try:
        code = app(prog_name="dielast", standalone_mode=False)
    except UsageError as error:
        code = tell_usage(error)
    except OSError as error:  # of the help and the version, no command's
        code = tell_refusal(error)
    sys.exit(code)
