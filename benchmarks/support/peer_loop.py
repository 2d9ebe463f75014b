"""Loop of a peer process: run a batch of a named work on request and answer with its processor seconds.

Peers run in their own environment and import only ``turns`` of this program. Protocol lines start with @, since peers
print banners.
"""

import sys
from collections.abc import Callable

import numpy as np
from turns import make_batch


def problem() -> dict[str, np.ndarray]:
    """Return the arrays by name of the problem file (NPZ) that is the first word of the command line."""
    with np.load(sys.argv[1]) as arrays:
        return dict(arrays)


def serve(force: np.ndarray, works: dict[str, Callable[[], object]]) -> None:
    """Serve a benchmark as a peer process: measure the work that each line of the standard input names.

    The answer to a line is "@" and the processor seconds per call; the function returns at the end of the input.

    Args:
        force: Internal force at the displacement of the problem, shape (n, 3) [N], written to the file that is the
            second word of the command line.
        works: Name of a work -> function that does it once.
    """
    np.save(sys.argv[2], force)
    batches = {name: make_batch(work) for name, work in works.items()}
    print("@ready", flush=True)
    for line in sys.stdin:
        print(f"@{batches[line.strip()]()}", flush=True)
