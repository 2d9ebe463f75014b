"""Scenes of flowing liquids for any particle method: parameters, start, walls, exact flows; start with ``flow.py``."""
