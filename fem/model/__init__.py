"""One model on one rank: elements, masses, force terms, local time steps, critical steps; start with `body.py`."""
