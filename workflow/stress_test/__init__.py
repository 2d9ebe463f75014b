"""Hard cases as data: what breaks solvers like these, tried within bounds, and random ones."""
