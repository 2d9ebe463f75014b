"""Loads and damping: objects in a list, each with its force and its work; start with `load.py`."""
