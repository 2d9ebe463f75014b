"""Sections of the report on a package: its joints, their meshes, the shock.

``report.html`` begins with warnings, the verdict, and each headline figure with its discretisation error, the error of
two scales and what is left out. Discretisation errors are those that ``accuracy`` found for the same inputs
(``convergence/known.py``). Sections follow where the run has them, also after a run that ended early: warpage, each
distinct joint beside the truncated sphere of its volume, maps of the array, joint meshes, histories of both modes,
ranked joints, stress at the package's pads, the coupling, the energy balance, cost, accuracy, effects, parameters and
versions.
"""
