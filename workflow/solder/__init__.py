"""Cases of solder alone: a drop, a joint, two drops, an oscillating drop. Start with `case.py`."""
