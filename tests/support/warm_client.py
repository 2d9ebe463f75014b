"""Client of the server of ``warm_start``; it imports little, since each Snakemake and each stage begins with it."""

import json
import os
import socket
from collections.abc import Sequence


def ask(address: str, words: Sequence[str], streams: Sequence[int], cwd: str | None = None) -> int:
    """Have the server run a module with arguments and standard streams, until it or this process ends.

    Args:
        address: Path of the server's socket.
        words: Module and its arguments.
        streams: File descriptors of standard input, output and error.
        cwd: Folder in which it runs; None for the present one.

    Returns:
        Exit code of the module, or minus the signal that ended it.
    """
    request = {"words": words, "cwd": cwd or os.getcwd(), "environment": dict(os.environ)}
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(address)
        socket.send_fds(connection, [b"\n"], streams)
        connection.sendall(json.dumps(request).encode() + b"\n")
        return int(connection.makefile().readline())
