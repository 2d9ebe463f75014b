"""Akantu process of ``two_scale_peers.py``: explicit steps of a whole package under a body acceleration."""

import akantu
import numpy as np
from peer_loop import problem, serve

inputs = problem()
akantu.parseInput(str(inputs["materials"]))
mesh = akantu.Mesh(3)
mesh.read(str(inputs["mesh"]))
if not np.allclose(mesh.getNodes()[:], inputs["points"], rtol=0.0, atol=1e-12):
    raise RuntimeError("Akantu has numbered the nodes in another way")
model = akantu.SolidMechanicsModel(mesh)
model.setMaterialSelector(akantu.MeshDataMaterialSelectorString("physical_names", model))
model.initFull(_analysis_method=akantu._explicit_lumped_mass)
step = float(inputs["step"])
model.setTimeStep(step)
model.getBlockedDOFs()[:] = inputs["held"]
model.assembleMassLumped()
weight = model.getMass()[:] * [0.0, 0.0, 1.0]
watched = inputs["watched"]
time = 0.0


def advance() -> None:
    """Take one step of the global model under the half sine of the acceleration, and advance the global time."""
    global time
    time += step
    share = time / float(inputs["pulse"])
    model.getExternalForce()[:] = weight * (float(inputs["peak"]) * np.sin(np.pi * share) if share < 1.0 else 0.0)
    model.solveStep()


history = [np.zeros(len(watched))]
for _ in range(int(inputs["samples"])):
    for _ in range(int(inputs["stride"])):
        advance()
    history.append(model.getDisplacement()[watched, 2].copy())
serve(np.array(history), {"step": advance})
