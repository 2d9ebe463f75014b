"""Time integration, participants, energy balance, histories; start with `central_difference.py`."""
