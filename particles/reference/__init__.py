"""Exact and independent solutions: Young-Laplace shapes, Rayleigh's oscillation."""
