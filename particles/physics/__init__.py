"""Forces, operators and constraints of a liquid body; start with ``physics.py``."""
