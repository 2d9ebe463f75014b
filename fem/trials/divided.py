"""The program's own division of a mesh in memory, its checks included."""

from collections.abc import Callable

from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.division import Division
from reflowshock.fem.division.rules import Rules
from reflowshock.fem.division.tables import joined
from reflowshock.fem.division.whole import Survey, Treatment, Whole, survey
from reflowshock.fem.materials.elasticity import role_of_part
from reflowshock.fem.materials.parameters import Material
from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.problem.shock import Coupling

Divide = Callable[[Whole, Survey, Rules], Division]
DEFAULTS, HELD = Materials(), Coupling(scheme="held_velocity")
DURATION = 1e-2  # [s] so long that a whole number of windows shortens none


def surveyed(
    mesh: MeshData,
    materials: Materials | dict[str, Material] = DEFAULTS,
    fraction: float = 0.9,
    coupling: Coupling = HELD,
) -> tuple[Whole, Survey, Rules]:
    """Return a mesh, its survey, and the rules of its division, in which boards are coarse."""
    whole = joined(mesh)
    coarse = whole.mesh.in_parts(lambda name: role_of_part(name) == "board")
    return whole, survey(whole.mesh, materials, Treatment()), Rules(coupling, coarse, fraction, 0.0, DURATION, 1)


def checked(whole: Whole, found: Survey, rules: Rules) -> Division:
    """Divide as the program does, its checks included."""
    division = divide(whole, found, rules)
    check_division(whole, found, division, rules)
    return division
