"""Time integration, participants, energy balance, histories, modes; start with `central_difference.py`."""
