"""Printed parts: drops of ink by delta-SPH that land one after the other and cure. Start with ``printing.py``."""
