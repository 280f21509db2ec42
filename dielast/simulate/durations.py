"""Durations in words, as columns and figures name the times after which something is wanted."""

DURATIONS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (1.0, "s"), (1e-3, "ms"), (1e-6, "\N{MICRO SIGN}s"), (1e-9, "ns"))


def lasting(seconds: float, digits: int = 9) -> str:
    """A time as text, in the largest unit of which it is at least one."""
    for unit, name in DURATIONS:
        if seconds >= unit * (1 - 1e-9):
            return f"{seconds / unit:.{digits}g} {name}"
    return f"{seconds:.{digits}g} s"
