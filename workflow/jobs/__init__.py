"""Making products: jobs of Snakemake on this machine or on a cluster; start with `batch.py`."""
