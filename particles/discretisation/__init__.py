"""Tetrahedra between particles, and solvers of the linear systems of a step; start with ``incompressibility.py``."""
