"""Effects, time steps and cost, predicted before anything is meshed with plain NumPy; start with `estimate.py`."""
