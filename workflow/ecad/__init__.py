"""Boards from ECAD files: what a file says of outline, holes and pads, and the case that is made of it."""
