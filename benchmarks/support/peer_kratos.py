"""Kratos process of ``peers.py`` and ``nonlinear.py``: explicit steps of hexahedra; it offers no force alone."""

import KratosMultiphysics as Kratos
import numpy as np
from kratos_model import explicit_model
from peer_loop import problem, serve

inputs = problem()
cube, advance = explicit_model(inputs)
for node, value in zip(cube.Nodes, inputs["displacement"].tolist(), strict=True):
    node.SetSolutionStepValue(Kratos.DISPLACEMENT, Kratos.Array3(value))
    if inputs["finite"]:  # finite-strain elements read current coordinates
        node.X, node.Y, node.Z = node.X0 + value[0], node.Y0 + value[1], node.Z0 + value[2]
advance()
force = np.array([list(node.GetSolutionStepValue(Kratos.FORCE_RESIDUAL)) for node in cube.Nodes])
serve(force, {"step": advance})
