"""Program of each MPI rank: read the input, run it, and end all ranks when one fails or waits too long."""

import json
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpi4py import MPI

from reflowshock.fem.errors import AgreedError, EnergyError, InvertedElementError, RankError
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.watchdog import Watchdog
from reflowshock.fem.problem.inputs import INPUT, CoolingInput, RunInput, StructureInput
from reflowshock.fem.problem.structure_checks import check
from reflowshock.fem.run.cooling import run_cooling
from reflowshock.fem.run.package import run_package
from reflowshock.fem.run.structure import run_structure

RUNS: dict[type, Callable[[MPI.Comm, Any], None]] = {
    RunInput: run_package,
    CoolingInput: run_cooling,
    StructureInput: run_structure,
}


def main(world: MPI.Comm, arguments: list[str]) -> int:
    """Run the JSON input file named by the only argument; collective over ``world``.

    Errors are printed by rank 0. An inverted element or an unexpected exception ends the MPI job on all ranks.

    Args:
        world: Communicator of all ranks.
        arguments: Command-line arguments without the program, which are one path.

    Returns:
        Exit code, 0 for success and 1 for an error.
    """
    try:
        request = agreed(world, lambda: _read_input(arguments))
    except AgreedError as error:
        if world.rank == 0:
            print(f"error: {error}", file=sys.stderr, flush=True)
        return 1
    watchdog = Watchdog(world, request.output, request.watchdog_seconds)
    try:
        RUNS[type(request)](world, request)
    except (AgreedError, EnergyError, RankError) as error:  # raised on every rank
        if world.rank == 0:
            watchdog.speak(str(error))
        return 1
    except InvertedElementError as error:
        _end_all(world, watchdog, str(error))
    except Exception:
        _end_all(world, watchdog, f"\n{traceback.format_exc().rstrip()}")
    finally:
        watchdog.stop()
    return 0


def _end_all(world: MPI.Comm, watchdog: Watchdog, message: str) -> None:
    """Report an error that occurred only on this rank, and end the ranks that wait for it."""
    watchdog.speak(f"rank {world.rank}: {message}")
    world.Abort(1)


def _read_input(arguments: list[str]) -> RunInput | CoolingInput | StructureInput:
    """Read and check the input file, and create the output directory."""
    if len(arguments) != 1:
        raise ValueError("usage: mpirun -n N python -m fem INPUT.json")
    request = INPUT.validate_python(json.loads(Path(arguments[0]).read_text(encoding="utf-8")))
    if isinstance(request, StructureInput):
        check(request)
    request.output.mkdir(parents=True, exist_ok=True)
    return request
