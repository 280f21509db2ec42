"""Hand a command line to server.py, with folder, environment and streams, and end as the command does.

`python -I -S client.py SOCKET ARGUMENTS...` stands for `dielast ARGUMENTS...` in a shell and starts in 20 ms.
"""

import json
import os
import socket
import sys


def ask(
    address: str,
    arguments: list[str],
    folder: str,
    environment: dict[str, str],
    streams: tuple[int, int, int],
    prelude: str = "",
    within: float | None = None,
) -> int:
    """The exit code of `dielast` with these arguments and streams (descriptors), after `prelude` (Python)."""
    request = {"arguments": arguments, "folder": folder, "environment": environment, "prelude": prelude}
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(within)
        line.connect(address)
        socket.send_fds(line, [b"\n"], streams)
        line.sendall(json.dumps(request).encode())
        line.shutdown(socket.SHUT_WR)
        return int(line.recv(16))


if __name__ == "__main__":
    sys.exit(ask(sys.argv[1], sys.argv[2:], os.getcwd(), dict(os.environ), (0, 1, 2)))
