"""The command ``accuracy``: convergence study of a case, its cost, recommended settings. Start with `command.py`."""
