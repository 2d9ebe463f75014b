"""Internal forces of elements: congruent boxes, assembled blocks, nonlinear; start with `force.py`."""
