"""The loop of a peer's process: it makes a batch of a work when asked by name, and answers with its processor seconds.

Peers run in their own environment and import nothing of this program but ``turns``. Lines of the protocol start with @,
since peers print banners.
"""

import sys
from collections.abc import Callable

import numpy as np
from turns import batch


def problem() -> dict[str, np.ndarray]:
    """Return points, cells (cyclic order), displacement and constants from the file of the command line."""
    with np.load(sys.argv[1]) as arrays:
        return dict(arrays)


def serve(force: np.ndarray, works: dict[str, Callable[[], object]]) -> None:
    """Write the internal force ``(n, 3)`` [N] at the given displacement, then answer until the input ends."""
    np.save(sys.argv[2], force)
    batches = {name: batch(work) for name, work in works.items()}
    print("@ready", flush=True)
    for line in sys.stdin:
        print(f"@{batches[line.strip()]()}", flush=True)
