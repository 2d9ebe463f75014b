"""Stages as jobs of a cluster: what each asks for, what is checked before, how Snakemake submits and ends them."""
