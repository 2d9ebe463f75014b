"""Time integration, participants, energy balance, histories and natural modes; start with `central_difference.py`."""
