"""What a case says of a shock, a structure or a reflow's heat, and what it may not. No numerical library."""
