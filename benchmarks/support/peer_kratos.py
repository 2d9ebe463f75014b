"""Kratos' side of ``peers.py``: explicit steps of small-strain linear hexahedra; it offers no force alone."""

import KratosMultiphysics as Kratos
import KratosMultiphysics.StructuralMechanicsApplication as Structural
import numpy as np
from peer_loop import problem, serve

STEP_VARIABLES = (
    Kratos.DISPLACEMENT,
    Kratos.VELOCITY,
    Kratos.ACCELERATION,
    Kratos.REACTION,
    Kratos.VOLUME_ACCELERATION,
    Kratos.NODAL_MASS,
    Kratos.FORCE_RESIDUAL,
    Kratos.RESIDUAL_VECTOR,
    Structural.MIDDLE_VELOCITY,
    Structural.FRACTIONAL_ACCELERATION,
)


def cube_of(given: dict[str, np.ndarray], cube: Kratos.ModelPart) -> None:
    """Fill a model part with nodes, elements and material."""
    for variable in STEP_VARIABLES:
        cube.AddNodalSolutionStepVariable(variable)
    material = cube.CreateNewProperties(1)
    material[Kratos.YOUNG_MODULUS] = float(given["young_modulus"])
    material[Kratos.POISSON_RATIO] = float(given["poisson_ratio"])
    material[Kratos.DENSITY] = float(given["density"])
    material[Kratos.CONSTITUTIVE_LAW] = Structural.LinearElastic3DLaw()
    for number, point in enumerate(given["points"].tolist(), start=1):
        cube.CreateNewNode(number, *point)
    for number, nodes in enumerate((given["cells"] + 1).tolist(), start=1):
        cube.CreateNewElement("SmallDisplacementElement3D8N", number, nodes, material)
    for axis in "XYZ":
        pair = [Kratos.KratosGlobals.GetVariable(f"{name}_{axis}") for name in ("DISPLACEMENT", "REACTION")]
        Kratos.VariableUtils().AddDof(*pair, cube)


Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
given = problem()
model = Kratos.Model()
cube = model.CreateModelPart("cube", 2)
information = cube.ProcessInfo
information[Kratos.DOMAIN_SIZE] = 3
information[Kratos.COMPUTE_LUMPED_MASS_MATRIX] = True
information[Structural.RAYLEIGH_ALPHA] = information[Structural.RAYLEIGH_BETA] = 0.0
cube_of(given, cube)
step = float(given["step"])
information[Kratos.DELTA_TIME] = step
scheme = Structural.ExplicitCentralDifferencesScheme(1.0, 1.0 / 3.0, 0)
strategy = Structural.MechanicalExplicitStrategy(cube, scheme, False, False, False)
strategy.SetEchoLevel(0)
strategy.SetRebuildLevel(0)
strategy.Initialize()
for node, value in zip(cube.Nodes, given["displacement"].tolist(), strict=True):
    node.SetSolutionStepValue(Kratos.DISPLACEMENT, Kratos.Array3(value))


def advance() -> None:
    """Take one step as Kratos' explicit solver does."""
    cube.CloneTimeStep(information[Kratos.TIME] + step)
    strategy.InitializeSolutionStep()
    strategy.Predict()
    strategy.SolveSolutionStep()
    strategy.FinalizeSolutionStep()


advance()
force = np.array([list(node.GetSolutionStepValue(Kratos.FORCE_RESIDUAL)) for node in cube.Nodes])
serve(force, {"step": advance})
