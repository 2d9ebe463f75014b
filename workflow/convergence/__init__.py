"""Convergence studies: the runs of each kind of case, their errors and costs, and how both are shown."""
