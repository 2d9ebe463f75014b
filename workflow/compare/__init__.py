"""The command ``compare``: differences between runs in parameters and results. Start with `runs.py`."""
