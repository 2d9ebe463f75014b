"""Fields, watch points, results and comparisons of runs; start with `result.py`."""
