"""ISPG in two dimensions: bodies of revolution by their meridian, and plane drops; start with ``section_step.py``."""
