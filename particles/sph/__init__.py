"""Weakly compressible delta-SPH: fluids that splash, drip and flow through channels; start with `simulation.py`.

Formula, loop, data and orchestration stand apart. `smoothing.py` and `pair_terms.py` are functions of one pair of
particles; `particle_rates.py` sums them over the neighbours of one particle, which `particle_motion.py` moves.
`threads.py` has the loops over particles, `cuda_loops.py` the same on a GPU, where `cuda_particles.py` has the arrays.
`neighbour_rows.py` is who is beside whom, `fluid_state.py` the arrays, `simulation.py` a step, `flow.py` a run from
scene to result. Surface tension is `liquid_surface.py`, with its loops in `surface_loops.py`.
"""
