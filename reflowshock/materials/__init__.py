"""Laws of materials as plain functions that NumPy, numba and UFL can use; they know no solver."""
