"""Coupling of two models in one run: schemes, placement on ranks, self-check; start with `scheme.py`."""
