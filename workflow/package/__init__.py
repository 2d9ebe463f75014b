"""A package on a board: its case, its joints as the user gives them, and what its stages found."""
