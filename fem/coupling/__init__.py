"""Coupling of two models of one run: schemes, placement on ranks, self-check; start with `scheme.py`."""
