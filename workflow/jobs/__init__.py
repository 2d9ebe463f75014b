"""Jobs that make products: Snakemake on this machine or on a cluster; start with ``batch.py``."""
