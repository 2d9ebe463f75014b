"""Operators on tetrahedra of the particles, and the linear systems of a step."""
