"""Client of the server of ``warm_start``; it imports little, since each Snakemake and each stage begins with it."""

import json
import socket
from collections.abc import Mapping, Sequence


def ask(address: str, request: Mapping[str, object], streams: Sequence[int]) -> int:
    """Have the server run a module with arguments and standard streams, until it or this process ends.

    Args:
        address: Path of the server's socket.
        request: Module and its arguments ("words"), working folder ("cwd") and environment variables ("environment").
        streams: File descriptors of standard input, output and error.

    Returns:
        Exit code of the module, or minus the signal that ended it.
    """
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(address)
        socket.send_fds(connection, [b"\n"], streams)
        connection.sendall(json.dumps(request).encode() + b"\n")
        return int(connection.makefile().readline())
