"""Base of all particle methods: cells, neighbours, grid, clouds, plates, checkpoints; start with ``body.py``."""
