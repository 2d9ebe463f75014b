"""Commands without start-up time: a server with loaded libraries forks a process for each command.

Snakemake, stages and MPI ranks are forked as well, since the Python that they call asks the server. Tests of
environments, signals and the first command use ``python -m reflowshock`` instead.
"""

import atexit
import gc
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pathlib import Path

from tests.support.compiled_once import collect_garbage_rarely, compile_once
from tests.support.warm_client import ask

ROOT = Path(__file__).resolve().parents[2]
# Modules of commands, stages and ranks, except MPI and its users: a process with MPI initialised cannot be forked.
LIBRARIES = (
    "ffcx", "gmsh", "matplotlib.backends.backend_agg", "matplotlib.pyplot", "meshio", "numba", "pandas",
    "pyvista.plotting", "scipy.signal", "scipy.sparse.linalg", "scipy.spatial", "snakemake.cli", "ufl",
    "reflowshock.fem.elements.element", "reflowshock.fem.kernels.box_rows", "reflowshock.fem.kernels.levels",
    "reflowshock.fem.kernels.nonlinear", "reflowshock.fem.mesh.mesh", "reflowshock.fem.problem.inputs",
    "reflowshock.workflow.cli", "reflowshock.workflow.reflow.joints", "reflowshock.workflow.run",
    "reflowshock.workflow.status",
)  # fmt: skip
MODULES = ("snakemake", "reflowshock", "reflowshock.fem", "reflowshock.workflow.reflow", "tests.support.on_ranks")
# A Python that asks the server to fork known modules, and otherwise runs Python itself.
CLIENT = """#!{python} -IS
import os, sys
words = sys.argv[1:]
if words[:1] != ["-m"] or words[1] not in {modules!r}:
    os.execv({python!r}, [{python!r}, *words])
sys.path.append({support!r})
from warm_client import ask
request = {{"words": words[1:], "cwd": os.getcwd(), "environment": dict(os.environ)}}
code = ask({address!r}, request, (0, 1, 2))
if code < 0:
    os.kill(os.getpid(), -code)
sys.exit(code)
"""


def warm_command(
    *arguments: str, cwd: Path | None = None, environment: Mapping[str, str] = os.environ
) -> subprocess.CompletedProcess:
    """Run a command of the program to its end, equivalent to ``python -m reflowshock``."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err, open(os.devnull) as nothing:
        streams = [file.fileno() for file in (nothing, out, err)]
        words, folder = ["reflowshock", *arguments], str(cwd or Path.cwd())
        request = {"words": words, "cwd": folder, "environment": dict(environment)}
        code = ask(str(_server() / "socket"), request, streams)
        said = [file.seek(0) or file.read() for file in (out, err)]
    return subprocess.CompletedProcess(arguments, code, *said)


def warm_python() -> str:
    """Return the path of a Python that asks the server to fork known modules."""
    return str(_server() / "python")


@cache
def _server() -> Path:
    """Start a server that ends with this process; return its folder."""
    folder = tempfile.TemporaryDirectory()
    server_folder, support = Path(folder.name), Path(__file__).parent
    names = {
        "python": sys.executable,
        "support": str(support),
        "address": str(server_folder / "socket"),
        "modules": MODULES,
    }
    client = CLIENT.format(**names)
    (server_folder / "python").write_text(client)
    (server_folder / "python").chmod(0o755)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(server_folder / "socket"))
        listener.listen()
        line = [sys.executable, "-m", "tests.support.warm_start", str(server_folder / "python"), str(listener.fileno())]
        server = subprocess.Popen(line, stdin=subprocess.PIPE, cwd=ROOT, pass_fds=[listener.fileno()])
    atexit.register(folder.cleanup)
    atexit.register(server.communicate)
    return server_folder


def serve(client: str, listener: socket.socket) -> None:
    """Load libraries and most of the program; then fork a process for each request until the standard input ends.

    Args:
        client: Path of the Python that sends the requests.
        listener: Listening socket.
    """
    from reflowshock.workflow.process.environment import prepare

    prepare()
    for library in LIBRARIES:
        import_module(library)
    import numba
    from rich.console import Console

    from reflowshock.workflow.pipeline.reader import read_case
    from reflowshock.workflow.plan import show_plan
    from reflowshock.workflow.store.point import Point
    from reflowshock.workflow.store.store import Store

    case = read_case(ROOT / "tests/pipeline/small.toml", oversubscribe=True)
    show_plan(Store(Path("nowhere"), one_run=True), Point({}, case), Console(quiet=True))
    compile_once()
    collect_garbage_rarely()
    numba.njit(lambda value: value)(0)  # loads the parts of Numba for first kernels
    gc.freeze()  # garbage collection would copy shared memory
    while listener in select.select([listener, sys.stdin], [], [])[0]:
        connection, _ = listener.accept()
        if os.fork() == 0:
            listener.close()
            answer(connection, client)
        connection.close()
        while os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            os.wait()


def answer(connection: socket.socket, client: str) -> None:
    """Read a request, fork the module, end it if the client disconnects, and send its exit code; do not return.

    Args:
        connection: Connection to the client.
        client: Path of the Python that sent the request.
    """
    _, streams, _, _ = socket.recv_fds(connection, 1, 3)
    request = json.loads(connection.makefile().readline())
    process = os.fork()
    if process == 0:
        connection.close()
        become(request, streams, client)
    over = os.pidfd_open(process)
    if over not in select.select([over, connection], [], [])[0]:
        os.kill(process, signal.SIGTERM)
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    connection.sendall(f"{code}\n".encode())
    os._exit(0)


def become(request: dict, streams: list[int], client: str) -> None:
    """Run the module of a request in this process to its end, and exit with its code.

    Args:
        request: ``words`` (module and arguments), ``cwd`` and ``environment``.
        streams: File descriptors of standard input, output and error.
        client: Path of the Python that sent the request.
    """
    import numba

    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["environment"])
    numba.core.config.reload_config()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.argv = request["words"]
    sys.executable = client
    code: str | int | None = None
    try:
        runpy.run_module(request["words"][0], run_name="__main__", alter_sys=True)
    except SystemExit as end:
        code = end.code
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    if "mpi4py.MPI" in sys.modules:
        sys.modules["mpi4py.MPI"].Finalize()
    os._exit(int(code or 0))  # freeing loaded libraries takes longer than most commands


if __name__ == "__main__":
    serve(sys.argv[1], socket.socket(fileno=int(sys.argv[2])))
