"""From input files to the models on each rank; `models.py` is what packages and structures share."""
