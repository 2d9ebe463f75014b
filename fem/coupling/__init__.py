"""Two models of one run: how they are divided, placed and coupled."""
