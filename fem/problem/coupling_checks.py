"""Coupled models of a structure that cannot be: names, and what needs one model. Loads neither numba nor DOLFINx."""

from collections.abc import Iterator

from reflowshock.fem.problem.structure import InputG, LayerCoupling, StructureProblem
from reflowshock.problem import Problem, unknown_name

KEY = "dynamics.coupling"


def coupling_problems(problem: StructureProblem) -> Iterator[Problem]:
    """Find what does not go with two models; nothing where there is one."""
    coupling = problem.dynamics.coupling
    if coupling is None:
        if problem.dynamics.solver == "dns":
            message = "is one model instead of two that are coupled"
            yield Problem("dynamics.solver", message, "dns", f"explicit, implicit, both, or a table {KEY}")
        return
    yield from _fine(coupling, problem)
    yield from _scheme(coupling, problem)
    yield from _ranks(coupling, problem.dynamics.ranks)
    yield from _one_model(problem)


def _fine(coupling: LayerCoupling, problem: StructureProblem) -> Iterator[Problem]:
    layers = problem.structure.layers
    for name in coupling.fine:
        yield from unknown_name(f"{KEY}.fine", name, layers, "layer")
    if layers and set(coupling.fine) >= set(layers):
        yield Problem(f"{KEY}.fine", "leaves no layer to the macro model", list(coupling.fine), "fewer layers")
    if problem.structure.element != "hexahedron":
        yield Problem(f"{KEY}", f"couples hexahedra, the element is {problem.structure.element}", None, "hexahedron")


def _scheme(coupling: LayerCoupling, problem: StructureProblem) -> Iterator[Problem]:
    if coupling.direction == "one_way":
        message = "needs a coarse mesh of the fine part, too, which only a package has"
        yield Problem(f"{KEY}.direction", message, "one_way", "two_way")
    materials = {name: problem.known_materials.get(layer.material) for name, layer in problem.structure.layers.items()}
    plastic = [name for name, material in materials.items() if material and material.plasticity is not None]
    if coupling.scheme == "local_steps" and (plastic or problem.dynamics.kinematics == "finite"):
        why = f"layers that yield: {', '.join(plastic)}" if plastic else "dynamics.kinematics = finite"
        message = f"needs elastic layers at small strains, there are {why}"
        yield Problem(f"{KEY}.scheme", message, "local_steps", "held_velocity, impulse, gravouil_combescure, auto")


def _ranks(coupling: LayerCoupling, ranks: int) -> Iterator[Problem]:
    if coupling.placement == "disjoint" and ranks < 2:
        yield Problem(
            f"{KEY}.placement", "needs a rank for each model", "disjoint", "auto, shared; dynamics.ranks >= 2"
        )
    if coupling.macro_ranks is not None and coupling.placement != "disjoint":
        yield Problem(f"{KEY}.macro_ranks", "is for placement = disjoint", coupling.macro_ranks, "none")
    elif coupling.macro_ranks is not None and coupling.macro_ranks >= ranks:
        message = "leaves no rank for the meso model"
        yield Problem(f"{KEY}.macro_ranks", message, coupling.macro_ranks, f"< {ranks}, dynamics.ranks")


def _one_model(problem: StructureProblem) -> Iterator[Problem]:
    """Yield what only one model can do."""
    dynamics = problem.dynamics
    if dynamics.solver == "implicit":
        yield Problem("dynamics.solver", "couples nothing", "implicit", "explicit or both, or no dynamics.coupling")
    if (
        dynamics.modes
        and dynamics.solver not in ("both", "dns")
        and not (dynamics.coupling and dynamics.coupling.compare)
    ):
        yield Problem("dynamics.modes", "are those of one model", dynamics.modes, f"0, or {KEY}.compare = true")
    if dynamics.numerics.explicit_step is not None:
        message = "is the step of one model, two have a window and smaller steps"
        yield Problem("dynamics.numerics.explicit_step", message, f"{dynamics.numerics.explicit_step:g} s", "none")
    if dynamics.numerics.critical_step != "element":
        message = "is for one model: windows rest on the steps of elements"
        yield Problem("dynamics.numerics.critical_step", message, dynamics.numerics.critical_step, "element")
    for name, load in problem.loads.items():
        if isinstance(load, InputG) and load.method == "large_mass":
            yield Problem(f"loads.{name}.method", "moves one model", "large_mass", "direct")
