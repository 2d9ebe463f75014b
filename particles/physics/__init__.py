"""What acts on a liquid body: a list of effects; start with `physics.py`."""
