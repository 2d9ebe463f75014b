"""Division of a mesh into macro and meso model and into step levels; start with `divide.py`."""
