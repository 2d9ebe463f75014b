"""Kernels on vectors of ``WIDTH`` elements as values; start with ``vector``, then ``memory`` and ``modes``."""
