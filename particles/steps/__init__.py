"""Time steps of a liquid body, with inertia or towards rest, and runs until it is at rest; start with ``flow.py``."""
