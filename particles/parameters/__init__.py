"""What a case says of the solder and its scene, which effects that calls for, what it will cost. No numba, no PETSc."""
