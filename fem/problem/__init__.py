"""Parameters of shocks, structures and reflow temperatures in a case, and their checks; start with `shock.py`."""
