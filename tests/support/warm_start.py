"""The command without its start-up: a server that has loaded the program forks a process for each command.

What a start of its own may change (environments, signals, a first word) is tested with `python -m reflowshock`.
"""

import atexit
import json
import os
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def warm_command(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess:
    """Run a command of the program to its end, as `python -m reflowshock` would."""
    with tempfile.TemporaryDirectory() as folder:
        files = [f"{folder}/stdout", f"{folder}/stderr"]
        request = {"arguments": arguments, "files": files, "cwd": str(cwd or Path.cwd()), "env": dict(os.environ)}
        server = _server()
        try:
            server.stdin.write(json.dumps(request) + "\n")
            server.stdin.flush()
            code = int(server.stdout.readline())
        except BaseException:  # a test that was broken off: its answer would be taken for that of the next
            server.kill()
            _server.cache_clear()
            raise
        return subprocess.CompletedProcess(arguments, code, *(Path(file).read_text() for file in files))


@cache
def _server() -> subprocess.Popen:
    line = [sys.executable, "-m", "tests.support.warm_start"]
    server = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    atexit.register(server.communicate)
    return server


def serve() -> None:
    """Plan a case, which loads most of the program; fork for each request on standard input; print each exit code."""
    from reflowshock.workflow.process.environment import prepare

    prepare()
    from rich.console import Console

    from reflowshock.workflow import cli, run, status  # noqa: F401
    from reflowshock.workflow.pipeline.reader import read_case
    from reflowshock.workflow.plan import show_plan
    from reflowshock.workflow.store.point import Point
    from reflowshock.workflow.store.store import Store

    case = read_case(ROOT / "tests/pipeline/small.toml", oversubscribe=True)
    show_plan(Store(Path("nowhere"), one_run=True), Point({}, case), Console(quiet=True))
    for line in sys.stdin:
        process = os.fork()
        if process == 0:
            become(json.loads(line))
        print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)


def become(request: dict) -> None:
    """Be the command of a request, to its end."""
    from reflowshock.__main__ import main

    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["env"])
    for number, name in enumerate([os.devnull, *request["files"]]):
        file = os.open(name, os.O_RDWR | os.O_CREAT)
        os.dup2(file, number)
        os.close(file)
    sys.argv = ["reflowshock", *request["arguments"]]
    main()
    sys.exit(0)


if __name__ == "__main__":
    serve()
