"""Joints and drops from their start to rest; start with ``reflow.py``."""
