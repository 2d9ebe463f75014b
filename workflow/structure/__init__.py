"""Structures of layers as a kind of case: model (``case.py``), stages, forecast, comparison with references, report."""
