"""The signals by which a user, a terminal that closes, a scheduler of jobs or the system asks a process to end."""

import signal

ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Ctrl-C, a request to end, and the end of the terminal, which Windows does not have."""
