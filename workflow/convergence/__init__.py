"""Convergence studies: measured errors against cost, fits of both, tables, plots. Start with `convergence_study.py`."""
