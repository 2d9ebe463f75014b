"""Flows computed by delta-SPH: start of the particles, samples, metrics. Start with ``dam_break.py``."""
