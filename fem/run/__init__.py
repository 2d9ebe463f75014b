"""Runs from input to results, as every rank executes them; start with `dynamics.py`."""
