"""Loop of a peer process: run a batch of a named work on request and answer with its processor seconds.

Peers run in their own environment and import only ``turns`` of this program. Protocol lines start with @, since peers
print banners.
"""

import sys
from collections.abc import Callable

import numpy as np
from turns import make_batch


def problem() -> dict[str, np.ndarray]:
    """Return the arrays of the problem file named on the command line."""
    with np.load(sys.argv[1]) as arrays:
        return dict(arrays)


def serve(force: np.ndarray, works: dict[str, Callable[[], object]]) -> None:
    """Write the internal force [N], shape (n, 3), at the displacement of the problem; answer until the input ends."""
    np.save(sys.argv[2], force)
    batches = {name: make_batch(work) for name, work in works.items()}
    print("@ready", flush=True)
    for line in sys.stdin:
        print(f"@{batches[line.strip()]()}", flush=True)
