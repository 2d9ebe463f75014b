"""Akantu's side of ``peers.py``: internal forces and explicit steps of small-strain linear hexahedra."""

import tempfile

import akantu
from peer_loop import problem, serve

MATERIAL = "material elastic [\n name = steel\n rho = {density}\n E = {young_modulus}\n nu = {poisson_ratio}\n]\n"

given = problem()
with tempfile.NamedTemporaryFile("w", suffix=".dat") as file:
    file.write(MATERIAL.format(**{name: float(given[name]) for name in ("density", "young_modulus", "poisson_ratio")}))
    file.flush()
    akantu.parseInput(file.name)
mesh = akantu.Mesh(3)
accessor = akantu.MeshAccessor(mesh)
accessor.resizeNodes(len(given["points"]))
mesh.getNodes()[:] = given["points"]
mesh.addConnectivityType(akantu._hexahedron_8)
accessor.resizeConnectivity(len(given["cells"]), akantu._hexahedron_8)
mesh.getConnectivity(akantu._hexahedron_8)[:] = given["cells"]
accessor.makeReady()
model = akantu.SolidMechanicsModel(mesh)
model.initFull(_analysis_method=akantu._explicit_lumped_mass)
model.setTimeStep(float(given["step"]))
model.getDisplacement()[:] = given["displacement"]
model.assembleInternalForces()
serve(model.getInternalForce(), {"force": model.assembleInternalForces, "step": model.solveStep})
