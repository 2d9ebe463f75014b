"""The command accuracy: a convergence study of a case, what its runs cost, and what to choose."""
