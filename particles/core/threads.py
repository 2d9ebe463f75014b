"""Number of threads of loops over particles: with few particles a thread, threads mostly wait for each other."""

from collections.abc import Iterator
from contextlib import contextmanager

from numba import get_num_threads, set_num_threads

# Particles that pay for one more thread.
PARTICLES_PER_THREAD = 4000


@contextmanager
def threads_for(particles: int) -> Iterator[None]:
    """Limit the number of threads to what pays for a number of particles, within a ``with`` block."""
    before = get_num_threads()
    set_num_threads(max(1, min(before, particles // PARTICLES_PER_THREAD)))
    try:
        yield
    finally:
        set_num_threads(before)
