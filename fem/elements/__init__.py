"""Finite elements: geometry, stiffness, lumped mass and critical time step; start with `element.py`."""
