"""Stable ISPG: the method of Hu et al. in a Galerkin form; start with ``ispg_step.py``.

With direct nodal integration, eq 12 with the mass of eq 14 is N^T m times a collocated equation, a strong form: its
gradient and divergence are not transposes of each other, and modes of the linearised scheme grow at any time step.

Equations of the paper and their counterparts here:

- 3, 12, 13: a friction solve, then all forces at predicted positions on the particles instead of N^T f
- 4, 25, 26: implicit surface tension acts together with the pressure, whose gradient is integrated by parts
- 5, 6, 21, 24: B (m/dt + dt K)^-1 B^T phi = -B v*, pressures at all particles; no collocated Laplacian
- 7 to 9, 22: the force is the gradient of the surface energy; no pressure is prescribed on the free surface
- 10: wetting is an energy whose balance gives the contact angle; no normal is overwritten (``surface/contact_line.py``)
- 11: linear MLS, support of 2 spacings, at least 16 neighbours; ghost particles behind walls
- 14, 15: masses of the mean of V and N^T V, fitted to the moments of the body (``nodal_volumes.py``)
- 16: 2 mu D : D instead of the Laplacian, so that no viscous stress acts on the free surface
- 17, 19, 20: pressure gradient B^T p; each pressure controls the volume of its particle
- 18: weight is a gradient of potential energy; no hydrostatic pressure is subtracted
- 23: ghost particles, moving ones too, instead of rows with normal derivatives, which make Krylov solvers fail
- 27, 28: x + dt v and friction on v - N v; x + dt N v would hide zigzag modes of the surface
- 29: an energy budget with every loss (``energy_budget.py``)

Not in the paper: insertion and removal of particles (``adaptation.py``), normal forces on walls with friction
(``normal_forces.py``), moving and floating plates (``moving_plates.py``), remeshing (``motion_transfer.py``).
"""
