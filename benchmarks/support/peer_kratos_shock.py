"""Kratos process of ``two_scale_peers.py``: explicit steps of a whole package under a body acceleration."""

import KratosMultiphysics as Kratos
import numpy as np
from kratos_model import explicit_model
from peer_loop import problem, serve

inputs = problem()
body, advance = explicit_model(inputs)
for node, held in zip(body.Nodes, inputs["held"].tolist(), strict=True):
    for variable, fixed in zip(
        (Kratos.DISPLACEMENT_X, Kratos.DISPLACEMENT_Y, Kratos.DISPLACEMENT_Z), held, strict=True
    ):
        if fixed:
            node.Fix(variable)
watched = [body.Nodes[int(number) + 1] for number in inputs["watched"]]
pulse, peak, step = (float(inputs[name]) for name in ("pulse", "peak", "step"))


def advance_under_load() -> None:
    """Take one step of the global model under the half sine of the acceleration, with the load at its beginning."""
    share = body.ProcessInfo[Kratos.TIME] / pulse
    load = Kratos.Array3([0.0, 0.0, peak * np.sin(np.pi * share) if share < 1.0 else 0.0])
    Kratos.VariableUtils().SetVariable(Kratos.VOLUME_ACCELERATION, load, body.Nodes)
    advance()


history = [np.zeros(len(watched))]
for _ in range(int(inputs["samples"])):
    for _ in range(int(inputs["stride"])):
        advance_under_load()
    history.append([node.GetSolutionStepValue(Kratos.DISPLACEMENT_Z) for node in watched])
serve(np.array(history), {"step": advance_under_load})
