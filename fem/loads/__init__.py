"""Loads, their pulses, and damping: objects in a list, each with its force and work; start with `load.py`."""
