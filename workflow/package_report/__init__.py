"""Sections of the report on a package: its joints, their meshes, the shock.

``report.html`` starts with warnings, the verdict, and each headline figure with its discretisation error, two-scale
error and neglected effects; the ranked joints and a 3D view of them at all stored times follow. Discretisation errors
come from ``accuracy`` with the same inputs (``convergence/discretisation.py``). Further sections appear where the run
has the products, also after a run that ended early: histories, board, effect of the joint shapes, stress at the package
pads, warpage, deviation of joints from truncated spheres, maps of the array. The appendix describes the computation:
parameters, meshes, coupling, energy balance, cost, accuracy, effects, health and versions.
"""
