"""What every rank does, in order; start with `program.py`."""
