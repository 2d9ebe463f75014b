"""Set-up of the models on each rank from input files; start with `models.py`, which packages and structures share."""
