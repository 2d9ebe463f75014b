"""MPI ranks: partitioning, messages, checkpoints and failures; start with `communicators.py`."""
