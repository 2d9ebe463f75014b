"""Sections of the report on a package: its joints, their meshes, the shock.

``report.html`` begins with warnings, the verdict, and each headline figure with its discretisation error, the error
of two scales and what is left out; then the ranked joints and a 3D view of them at all stored times. Discretisation
errors are those that ``accuracy`` found for the same inputs (``convergence/discretisation.py``). Sections follow where
the run has them, also after a run that ended early: histories, the board, what the real shapes change, stress at the
package's pads, warpage, joint shapes beside truncated spheres of their volumes, maps of the array. An appendix has
all on the computation: parameters, meshes, the coupling, the energy balance, cost, accuracy, effects, health and
versions.
"""
