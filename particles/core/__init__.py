"""What every particle method shares: clouds, neighbours, plates, tetrahedra, checkpoints; start with `body.py`."""
