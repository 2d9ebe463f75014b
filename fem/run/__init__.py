"""What every rank does, in order; start with `dynamics.py`."""
