"""One model on one rank: body, mass, step levels, critical steps; start with `body.py`."""
