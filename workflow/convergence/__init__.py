"""What accuracy costs: a convergence study of a case, and what to choose."""
