"""Kratos' side of ``peers.py`` and ``nonlinear.py``: explicit steps of hexahedra; it offers no force alone."""

import KratosMultiphysics as Kratos
import KratosMultiphysics.ConstitutiveLawsApplication as Laws
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
ELEMENTS = {"linear": "SmallDisplacementElement3D8N"}
LAWS = {
    "linear": Structural.LinearElastic3DLaw,
    "finite": Laws.KirchhoffSaintVenant3DLaw,
    "plastic": Laws.FiniteStrainIsotropicPlasticity3DVonMisesVonMises,
}
NO_HARDENING, NEVER = 3, 1e12  # of Kratos' curves; fracture energy [J/m^2]


def cube_of(given: dict[str, np.ndarray], cube: Kratos.ModelPart) -> None:
    """Fill a model part with nodes, elements and material."""
    for variable in STEP_VARIABLES:
        cube.AddNodalSolutionStepVariable(variable)
    material = cube.CreateNewProperties(1)
    material[Kratos.YOUNG_MODULUS] = float(given["young_modulus"])
    material[Kratos.POISSON_RATIO] = float(given["poisson_ratio"])
    material[Kratos.DENSITY] = float(given["density"])
    law = str(given["law"])
    material[Kratos.CONSTITUTIVE_LAW] = LAWS[law]()
    if law == "plastic":
        material[Kratos.YIELD_STRESS] = float(given["yield_stress"])
        material[Laws.HARDENING_CURVE], material[Kratos.FRACTURE_ENERGY] = NO_HARDENING, NEVER
    for number, point in enumerate(given["points"].tolist(), start=1):
        cube.CreateNewNode(number, *point)
    for number, nodes in enumerate((given["cells"] + 1).tolist(), start=1):
        cube.CreateNewElement(ELEMENTS.get(law, "TotalLagrangianElement3D8N"), number, nodes, material)
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
strategy = Structural.MechanicalExplicitStrategy(cube, scheme, False, False, bool(given["law"] != "linear"))
strategy.SetEchoLevel(0)
strategy.SetRebuildLevel(0)
strategy.Initialize()
for node, value in zip(cube.Nodes, given["displacement"].tolist(), strict=True):
    node.SetSolutionStepValue(Kratos.DISPLACEMENT, Kratos.Array3(value))
    if given["law"] != "linear":  # its elements of finite strain look at the places
        node.X, node.Y, node.Z = node.X0 + value[0], node.Y0 + value[1], node.Z0 + value[2]


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
