"""What accuracy costs: ladders of settings, their errors and costs, and what to choose."""
