"""Weakly compressible delta-SPH: fluids that splash, drip and flow through channels; start with ``simulation.py``.

Formulas, loops, data and orchestration are separate. ``smoothing.py``, ``pair_terms.py`` and ``particle_pairs.py`` have
functions of one pair of particles; ``particle_rates.py`` sums them over the neighbours of one particle, and
``particle_motion.py`` integrates in time. ``threads.py`` has the loops over particles and the neighbour lists,
``cuda_loops.py`` and ``cuda_particles.py`` the same on a GPU, ``fluid_state.py`` the arrays, ``simulation.py`` a time
step, ``flow.py`` a run from scene to result. Surface tension is in ``liquid_surface.py``, ``capillary_forces.py`` and
``surface_coupling.py``.
"""
