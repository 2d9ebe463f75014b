"""Board, package and pads, and boxes of layers, as named structured meshes; start with `assembly.py`."""
