"""On how many threads loops over particles run: waiting for each other, those of a few particles only burn time."""

from collections.abc import Iterator
from contextlib import contextmanager

from numba import get_num_threads, set_num_threads

# With fewer particles a thread more costs more than it brings.
PARTICLES_PER_THREAD = 4000


@contextmanager
def threads_for(particles: int) -> Iterator[None]:
    """Let loops run on as many threads as pay for so many particles, and afterwards on as many as before."""
    before = get_num_threads()
    set_num_threads(max(1, min(before, particles // PARTICLES_PER_THREAD)))
    try:
        yield
    finally:
        set_num_threads(before)
