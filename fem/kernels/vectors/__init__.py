"""Kernels that treat SIMD vectors of ``WIDTH`` lanes as values; read ``vector`` first, then ``memory``, ``modes``."""
