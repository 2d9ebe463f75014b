"""Quasi-static problems: reflow temperatures, cooling, residual stress, modes."""
