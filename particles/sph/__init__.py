"""Weakly compressible delta-SPH: fluids that splash, drip and flow through channels; start with `simulation.py`.

Formula, loop, data and orchestration stand apart. `smoothing.py` and `pair_terms.py` are functions of one pair of
particles; `particle_rates.py` sums them over the neighbours of one particle, which `particle_motion.py` moves.
`threads.py` has the loops over particles and who is beside whom, `cuda_loops.py` and `cuda_particles.py` the same on a
GPU, `fluid_state.py` the arrays, `simulation.py` a step, `flow.py` a run from scene to result. Surface tension is
`liquid_surface.py`, with its loops in `surface_loops.py` and the care of its triangles in `surface_care.py`.
"""
