"""Parameters of solder and scenes, their checks, active effects and cost estimates; loads neither numba nor PETSc."""
