"""Effects, time steps and cost before anything is meshed. Plain NumPy."""
