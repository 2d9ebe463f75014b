"""Akantu process of ``peers.py`` and ``nonlinear.py``: internal forces and explicit steps of elastic hexahedra.

Its J2 material is left out: with ``finite_deformation`` it has a stress under a pure rotation (Akantu 5.0.7).
"""

import tempfile

import akantu
from peer_loop import problem, serve

inputs = problem()
lines = [f"{key} = {value}" for key, value in zip(("rho", "E", "nu"), inputs["constants"][0, :3].tolist(), strict=True)]
lines.append(f"finite_deformation = {'true' if inputs['finite'] else 'false'}")
with tempfile.NamedTemporaryFile("w", suffix=".dat") as file:
    file.write("\n".join(["material elastic [", "name = cube", *lines, "]", ""]))
    file.flush()
    akantu.parseInput(file.name)
mesh = akantu.Mesh(3)
accessor = akantu.MeshAccessor(mesh)
accessor.resizeNodes(len(inputs["points"]))
mesh.getNodes()[:] = inputs["points"]
mesh.addConnectivityType(akantu._hexahedron_8)
accessor.resizeConnectivity(len(inputs["cells"]), akantu._hexahedron_8)
mesh.getConnectivity(akantu._hexahedron_8)[:] = inputs["cells"]
accessor.makeReady()
model = akantu.SolidMechanicsModel(mesh)
model.initFull(_analysis_method=akantu._explicit_lumped_mass)
model.setTimeStep(float(inputs["step"]))
model.getDisplacement()[:] = inputs["displacement"]
model.assembleInternalForces()
serve(model.getInternalForce(), {"force": model.assembleInternalForces, "step": model.solveStep})
