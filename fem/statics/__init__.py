"""Quasi-static problems: board and package during reflow, residual stress of cooling; start with `structure.py`."""
