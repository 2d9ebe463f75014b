"""From input files to the models on each rank."""
