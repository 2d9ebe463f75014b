"""Import of boards from ECAD files: readers for outline, holes and pads, and the case files written from them.

Start with ``command.py``; each reader returns a ``Layout`` (``layout.py``).
"""
