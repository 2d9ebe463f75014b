"""Which cells are whose: macro or meso model, and which step level; start with `divide.py`."""
