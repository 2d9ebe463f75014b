"""One time step towards rest or with inertia, and steps until rest; start with `flow.py`."""
