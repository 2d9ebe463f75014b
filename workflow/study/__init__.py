"""Parametric studies: one case with many settings. Start with `study_file.py` and `command.py`."""
