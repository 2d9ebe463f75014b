"""A package on a board: its joints reflowed, then the board dropped."""
