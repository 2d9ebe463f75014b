"""Closed surfaces of joints, from particles, formulas or user files; start with ``closed_surface.py``."""
