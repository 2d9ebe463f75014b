"""Sections of the report on a package: its joints, their meshes, the shock.

``report.html`` begins with the critical joint, its peak stress, what the real shapes change in it, the margin, and
warnings. Sections follow where the run has them, also after a run that ended early: warpage, each distinct joint beside
the truncated sphere of its volume, maps of the array, joint meshes, histories of both modes, ranked joints, stress at
the package's pads, the coupling, the energy balance, cost, accuracy, effects, parameters and versions.
"""
