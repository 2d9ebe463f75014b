"""The folder of compiled kernels, one for the sources that they were made from, and how long compiling them takes."""

import os
import tempfile
from collections.abc import Iterable, Mapping, MutableMapping
from contextlib import suppress
from pathlib import Path

from reflowshock.kernel_place import VARIABLE, digest, is_made, present

# Stage -> one of the kernels that it compiles, and the processor seconds that it takes to compile all of them, as on
# jedec_bga; a stage of the same name in another kind of case takes no more.
KERNELS = {"reflow": ("neighbours._compressed_rows", 24.0), "shock": ("levels.take_steps", 48.0)}


def keep_kernels_by_source(environment: MutableMapping[str, str] = os.environ) -> None:
    """Name the folder to Numba, which must not be loaded yet, and to all processes that this one starts.

    A folder that the user has named stays, if it can be written to. Where none can be made, it is a temporary one.
    """
    named = environment.get(VARIABLE)
    if named and is_made(Path(named)):
        return
    folder = _usual_folder(environment)
    if folder and is_made(folder):
        environment[VARIABLE] = str(folder)
        return
    environment[VARIABLE] = tempfile.mkdtemp(prefix="reflowshock-kernels-")


def compilation(stages: Iterable[str], environment: Mapping[str, str] = os.environ) -> float:
    """Predict for how long [s] stages will compile kernels: not at all where a run by these sources has done it."""
    named = environment.get(VARIABLE)
    folder = Path(named) if named else _usual_folder(environment)
    kept = {path.name.rpartition("-")[0] for path in present(folder).rglob("*.nbi")} if folder else set()
    return sum(seconds for stage, (kernel, seconds) in KERNELS.items() if stage in stages and kernel not in kept)


def _usual_folder(environment: Mapping[str, str]) -> Path | None:
    """Return the folder of the present sources; None where the user has no home."""
    with suppress(RuntimeError):
        home = environment.get("HOME") or Path.home()
        return Path(environment.get("XDG_CACHE_HOME") or Path(home, ".cache")) / "reflowshock" / f"kernels-{digest()}"
    return None
