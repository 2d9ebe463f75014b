"""Explicit Kratos model of hexahedra with one material each, for the processes of peers."""

from collections.abc import Callable

import KratosMultiphysics as Kratos
import KratosMultiphysics.ConstitutiveLawsApplication as Laws
import KratosMultiphysics.StructuralMechanicsApplication as Structural
import numpy as np

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
ELEMENTS = {True: "TotalLagrangianElement3D8N", False: "SmallDisplacementElement3D8N"}  # by finite strain or not
LAWS = {True: Laws.KirchhoffSaintVenant3DLaw, False: Structural.LinearElastic3DLaw}
NO_HARDENING, NEVER = 3, 1e12  # number of the Kratos hardening curve; fracture energy [J/m^2]
COLUMNS = (Kratos.DENSITY, Kratos.YOUNG_MODULUS, Kratos.POISSON_RATIO, Kratos.YIELD_STRESS)


def explicit_model(problem: dict[str, np.ndarray]) -> tuple[Kratos.ModelPart, Callable[[], None]]:
    """Return a body at rest in its initial state, and the function that advances it by one step.

    Args:
        problem: Arrays ``points`` [m], ``cells`` (nodes in cyclic order), ``material`` of each cell, ``constants`` of
            the materials (density, Young's modulus, Poisson's ratio, yield stress or nan), flag ``finite`` strain,
            ``step`` [s].
    """
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    finite, step = bool(problem["finite"]), float(problem["step"])
    body = model.CreateModelPart("body", 2)
    for variable in STEP_VARIABLES:
        body.AddNodalSolutionStepVariable(variable)
    fill(body, problem, finite)
    information = body.ProcessInfo
    information[Kratos.DOMAIN_SIZE] = 3
    information[Kratos.COMPUTE_LUMPED_MASS_MATRIX] = True
    information[Structural.RAYLEIGH_ALPHA] = information[Structural.RAYLEIGH_BETA] = 0.0
    information[Kratos.DELTA_TIME] = step
    scheme = Structural.ExplicitCentralDifferencesScheme(1.0, 1.0 / 3.0, 0)
    strategy = Structural.MechanicalExplicitStrategy(body, scheme, False, False, finite)
    strategy.SetEchoLevel(0)
    strategy.SetRebuildLevel(0)
    strategy.Initialize()

    def advance() -> None:
        body.CloneTimeStep(information[Kratos.TIME] + step)
        strategy.InitializeSolutionStep()
        strategy.Predict()
        strategy.SolveSolutionStep()
        strategy.FinalizeSolutionStep()

    return body, advance


model = Kratos.Model()  # owns the parts and must outlive them


def fill(body: Kratos.ModelPart, problem: dict[str, np.ndarray], finite: bool) -> None:
    """Add materials, nodes and elements to a model of Kratos.

    Args:
        body: Empty model, changed in place.
        problem: Arrays of ``explicit_model``.
        finite: Whether strains are finite.
    """
    materials = [material_of(body, number, row, finite) for number, row in enumerate(problem["constants"], start=1)]
    for number, point in enumerate(problem["points"].tolist(), start=1):
        body.CreateNewNode(number, *point)
    cells, kinds = (problem["cells"] + 1).tolist(), problem["material"].tolist()
    for number, (nodes, kind) in enumerate(zip(cells, kinds, strict=True), start=1):
        body.CreateNewElement(ELEMENTS[finite], number, nodes, materials[kind])
    for axis in "XYZ":
        pair = [Kratos.KratosGlobals.GetVariable(f"{name}_{axis}") for name in ("DISPLACEMENT", "REACTION")]
        Kratos.VariableUtils().AddDof(*pair, body)


def material_of(body: Kratos.ModelPart, number: int, row: np.ndarray, finite: bool) -> Kratos.Properties:
    """Add a material to a model of Kratos and return it: J2 without hardening if it yields, else linear elastic.

    Args:
        body: Model, changed in place.
        number: Number of the material.
        row: Density [kg/m^3], Young's modulus [Pa], Poisson's ratio, yield stress [Pa] or nan, shape (4,).
        finite: Whether strains are finite.
    """
    properties = body.CreateNewProperties(number)
    for variable, value in zip(COLUMNS, row.tolist(), strict=True):
        if np.isfinite(value):
            properties[variable] = value
    properties[Kratos.CONSTITUTIVE_LAW] = LAWS[finite]()
    if np.isfinite(row[-1]):
        properties[Kratos.CONSTITUTIVE_LAW] = Laws.FiniteStrainIsotropicPlasticity3DVonMisesVonMises()
        properties[Laws.HARDENING_CURVE], properties[Kratos.FRACTURE_ENERGY] = NO_HARDENING, NEVER
    return properties
