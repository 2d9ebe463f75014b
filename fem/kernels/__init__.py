"""Numba kernels; ``vectors`` has those whose values are vectors of elements, which the others are built on."""
