"""Number of threads of loops over particles; with few particles per thread, threads mostly wait for each other."""

from collections.abc import Iterator
from contextlib import contextmanager

from numba import get_num_threads, set_num_threads

# Number of particles for which an additional thread reduces the run time.
PARTICLES_PER_THREAD = 4000


@contextmanager
def threads_for(particles: int) -> Iterator[None]:
    """Limit Numba's threads within a ``with`` block to one per ``PARTICLES_PER_THREAD`` particles; yield None.

    Args:
        particles: Number of particles in the loops of the block; there is at least one thread.
    """
    before = get_num_threads()
    set_num_threads(max(1, min(before, particles // PARTICLES_PER_THREAD)))
    try:
        yield
    finally:
        set_num_threads(before)
