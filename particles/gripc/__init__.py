"""The ISPG scheme as Hu et al. (2.2-2.6) print it, for comparison; start with ``gripc_step.py``."""
