"""Checks of the parameters of a structure that contradict each other. Imports neither numba nor DOLFINx."""

import math
from collections.abc import Iterator

from reflowshock.fem.problem.attachment_checks import (
    attachment_problems,
    filter_problems,
    hole_problems,
    position_problems,
)
from reflowshock.fem.problem.fittings import AXES
from reflowshock.fem.problem.load_kinds import (
    AtPoint,
    InputG,
    OnAreas,
    OnBody,
    OnNodes,
    PrescribedMotion,
    StructureLoad,
)
from reflowshock.fem.problem.structure import LayerCoupling, StructureProblem
from reflowshock.problem import Problem, unknown_name

COUPLING = "dynamics.coupling"


def problems(problem: StructureProblem) -> list[Problem]:
    """Return the contradictions between parameters of a structure, empty if there are none; nothing is computed.

    Args:
        problem: Parameters of the structure.

    Returns:
        Input errors, each with key, message, value and allowed range.
    """
    return [
        *_structure(problem),
        *attachment_problems(problem),
        *(error for name, load in problem.loads.items() for error in _load(f"loads.{name}", load, problem)),
        *_large_mass(problem),
        *_symmetry(problem),
        *_dynamics(problem),
        *_coupling_problems(problem),
    ]


def check(problem: StructureProblem) -> None:
    """Raise an error if the parameters of a structure contradict each other; no mesh is needed.

    Args:
        problem: Parameters of the structure.

    Raises:
        ValueError: The message lists all contradictions, one per line.
    """
    errors = problems(problem)
    if errors:
        raise ValueError("\n".join(str(error) for error in errors))


def _structure(problem: StructureProblem) -> Iterator[Problem]:
    structure = problem.structure
    if not structure.layers:
        yield Problem("structure.layers", "the structure has no layer", None, "at least one table such as layers.board")
    for name, layer in structure.layers.items():
        yield from unknown_name(
            f"structure.layers.{name}.material", layer.material, problem.known_materials, "material"
        )
    if structure.element != "hexahedron" and structure.formulation == "one_point":
        message = f"applies to hexahedra, but the element is {structure.element}"
        yield Problem("structure.formulation", message, structure.formulation, "incompatible_modes (the default)")


def _load(key: str, load: StructureLoad, problem: StructureProblem) -> Iterator[Problem]:
    if isinstance(load, OnNodes | OnAreas):
        yield from unknown_name(f"{key}.on", load.on, problem.structure.facet_sets, "facet set")
    if isinstance(load, AtPoint):
        yield from position_problems(f"{key}.at", load.at, problem.structure)
        yield from hole_problems(f"{key}.at", load.at, problem.structure)
    if isinstance(load, OnBody | AtPoint) and not math.hypot(*load.direction) > 0.0:
        yield Problem(f"{key}.direction", "has no length", list(load.direction), "any vector but zero")
    if isinstance(load, InputG) and load.method == "direct" and not _is_held(problem):
        message = "needs a support that moves with the table, but the case has no supports"
        yield Problem(f"{key}.method", message, "direct", "a [supports.NAME]")
    if isinstance(load, PrescribedMotion):
        yield from _conflicts(key, load, problem)
    yield from _pulse(key, load)


def _large_mass(problem: StructureProblem) -> Iterator[Problem]:
    """Yield contradictions to a large mass, which moves all supports that fix x, y and z."""
    shaking = [name for name, load in problem.loads.items() if load.is_large_mass]
    if not shaking:
        return
    key = f"loads.{shaking[0]}.method"
    if not any(set(support.hold) == set(AXES) for support in problem.supports.values()):
        yield Problem(key, "needs a support that it can move: one that holds x, y, z", "large_mass", "direct")
    moved = {"initial_velocity": any(problem.dynamics.initial_velocity)}
    moved |= {f"loads.{name}": isinstance(load, PrescribedMotion) for name, load in problem.loads.items()}
    for cause in [name for name, is_present in moved.items() if is_present]:
        message = f"cannot be combined with {cause}: its velocities would be absolute, not relative to the supports"
        yield Problem(key, message, "large_mass", "direct")
    for name in shaking[1:]:
        yield Problem(f"loads.{name}.method", f"is already the method of loads.{shaking[0]}", "large_mass", "direct")
    for name in shaking:
        yield from _left_behind(name, problem)
    yield from _not_shaken(key, problem)


def _not_shaken(key: str, problem: StructureProblem) -> Iterator[Problem]:
    """Yield supports that fix in space some nodes of a support that a large mass moves."""
    shaken = [name for name, support in problem.supports.items() if set(support.hold) == set(AXES)]
    for name in shaken:
        support = problem.supports[name]
        for holder, on, _ in _held_sets(problem):
            if holder.removeprefix("supports.") not in shaken and _meet(on, support.on):
                message = f"cannot move supports.{name}: {holder} fixes nodes of it in space {_where(on, support.on)}"
                yield Problem(key, message, "large_mass", "direct")


def _left_behind(shaking: str, problem: StructureProblem) -> Iterator[Problem]:
    """Yield the supports that would stay in place along the direction of a large mass."""
    load = problem.loads[shaking]
    for name, support in problem.supports.items():
        along = [axis for axis in support.hold if isinstance(load, InputG) and load.direction[AXES.index(axis)]]
        if along and set(support.hold) != set(AXES):
            message = f"would stay in place along {' and '.join(along)} while the large mass of loads.{shaking} moves"
            yield Problem(f"supports.{name}.hold", message, list(support.hold), "x, y, z, or method = direct")


def _symmetry(problem: StructureProblem) -> Iterator[Problem]:
    """Yield loads and velocities that are not symmetric about a plane of symmetry."""
    pushes = {f"loads.{name}.direction": load for name, load in problem.loads.items()}
    vectors = {key: load.direction for key, load in pushes.items() if isinstance(load, OnBody)}
    vectors["dynamics.initial_velocity"] = problem.dynamics.initial_velocity
    for axis in problem.structure.symmetry:
        for key, vector in vectors.items():
            yield from _across(axis, key, vector)
        for name, load in problem.loads.items():
            if isinstance(load, AtPoint) and axis in problem.structure.planes_at(load.at):
                yield from _across(axis, f"loads.{name}.direction", load.direction)
            if isinstance(load, OnAreas) and load.on == f"{axis}_min":
                yield Problem(f"loads.{name}.on", "is a plane of symmetry inside the body", load.on, f"{axis}_max")


def _across(axis: str, key: str, vector: tuple[float, float, float]) -> Iterator[Problem]:
    """Yield a vector that is not its own mirror image."""
    if vector[AXES.index(axis)]:
        message = f"crosses the plane of symmetry {axis} = 0, on both sides of which it would have to be mirrored"
        yield Problem(key, message, list(vector), f"0 along {axis}, or no symmetry in {axis}")


def _is_held(problem: StructureProblem) -> bool:
    """Return whether a support or a prescribed motion acts on the body."""
    return bool(problem.supports) or any(isinstance(load, PrescribedMotion) for load in problem.loads.values())


def _conflicts(key: str, load: PrescribedMotion, problem: StructureProblem) -> Iterator[Problem]:
    """Yield supports and loads that prescribe the component that a load moves."""
    for holder, on, components in _held_sets(problem):
        if _meet(on, load.on) and load.component in components:
            yield Problem(f"{key}.component", f"is held by {holder} {_where(on, load.on)}", load.component)
    for name, other in problem.loads.items():
        if f"loads.{name}" == key:  # of two that clash, the later one is named
            return
        if isinstance(other, PrescribedMotion) and _meet(other.on, load.on) and other.component == load.component:
            yield Problem(f"{key}.component", f"is moved by loads.{name} {_where(other.on, load.on)}", load.component)


def _held_sets(problem: StructureProblem) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield name, facet set and fixed components of each support and plane of symmetry."""
    for name, support in problem.supports.items():
        yield f"supports.{name}", support.on, support.hold
    for axis in problem.structure.symmetry:
        yield "a plane of symmetry", f"{axis}_min", (axis,)


def _meet(first: str, second: str) -> bool:
    """Return whether two facet sets share nodes: all pairs do except opposite faces, and holes and side faces."""
    if first != second and "mounting_holes" in (first, second):
        return any(name.startswith("z") for name in (first, second))
    return first == second or first[0] != second[0]


def _where(first: str, second: str) -> str:
    return "on the same facet set" if first == second else f"where {first} and {second} meet"


def _pulse(key: str, load: StructureLoad) -> Iterator[Problem]:
    names = load.definitions
    if len(names) != 1 and (names or not load.has_default_peak):
        message = f"is given by {' and '.join(names) or 'nothing'}"
        yield Problem(key, message, None, f"exactly one of {load.alternatives}")
    elif ("peak" in names or load.has_default_peak) and load.pulse != "constant" and load.duration is None:
        if load.table is None:
            yield Problem(f"{key}.duration", f"is missing, a {load.pulse.replace('_', ' ')} needs it", None, "> 0")
    elif load.duration is not None and (load.jedec_condition or load.table):
        yield Problem(f"{key}.duration", f"is already given by {names[0]}", f"{load.duration:g} s")


def _yielding(problem: StructureProblem) -> Iterator[tuple[str, str]]:
    """Yield key and material of the layers that yield."""
    for name, layer in problem.structure.layers.items():
        material = problem.known_materials.get(layer.material)
        if material is not None and material.plasticity is not None:
            yield f"structure.layers.{name}.material", layer.material


def _nonlinear_damping(problem: StructureProblem) -> Iterator[Problem]:
    """Yield stiffness-proportional damping under finite rotations, where the elastic stiffness would have to rotate."""
    key = "dynamics.damping.stiffness_" + ("ratio" if problem.dynamics.damping.stiffness_ratio else "coefficient")
    if problem.dynamics.kinematics != "small":
        message = f"needs a constant stiffness, but dynamics.kinematics = {problem.dynamics.kinematics}"
        yield Problem(key, message, None, "mass_ratio")


def _dynamics(problem: StructureProblem) -> Iterator[Problem]:
    dynamics = problem.dynamics
    damping = dynamics.damping
    if "implicit" in dynamics.solvers and dynamics.kinematics != "small":
        message = "the implicit solver is linear"
        yield Problem("dynamics.kinematics", message, dynamics.kinematics, "small, or solver = explicit")
    if "implicit" in dynamics.solvers:
        yield from (
            Problem(key, f"yields, but the solver {dynamics.solver} is linear", material, "dynamics.solver = explicit")
            for key, material in _yielding(problem)
        )
    if (damping.mass_ratio or damping.stiffness_ratio) and damping.frequency is None:
        yield Problem("dynamics.damping.frequency", "is missing: the frequency of the damping ratios", None, "> 0 Hz")
    if damping.stiffness_ratio or damping.stiffness_coefficient:
        yield from _nonlinear_damping(problem)
    for name in dynamics.numerics.mass_scaled:
        yield from unknown_name("dynamics.numerics.mass_scaled", name, problem.structure.layers, "layer")
    if "filter" in dynamics.model_fields_set:
        yield from filter_problems("dynamics", dynamics.filter, dynamics.duration, dynamics.numerics.history_samples)
    yield from _numerics(problem)
    if not problem.loads and not any(dynamics.initial_velocity):
        allowed = "a table such as loads.drop, or an initial_velocity"
        yield Problem("loads", "nothing moves the structure", None, allowed)


def _numerics(problem: StructureProblem) -> Iterator[Problem]:
    dynamics, numerics = problem.dynamics, problem.dynamics.numerics
    longest = min([dynamics.duration, *(load.duration / 2 for load in problem.loads.values() if load.duration)])
    step = numerics.implicit_step
    if step is not None and step > longest:
        message = "is too long to resolve the motion: longer than the duration, or than half a pulse"
        yield Problem("dynamics.numerics.implicit_step", message, f"{step:g} s", f"<= {longest:g} s")
    if numerics.mass_scaled and "implicit" in dynamics.solvers:
        message = f"applies to explicit steps, but the solver is {dynamics.solver}"
        yield Problem("dynamics.numerics.mass_scaled", message, list(numerics.mass_scaled), "none")
    if problem.structure.layers and set(numerics.mass_scaled) >= set(problem.structure.layers):
        message = "leaves no layer that defines the time step"
        yield Problem("dynamics.numerics.mass_scaled", message, list(numerics.mass_scaled))


def _coupling_problems(problem: StructureProblem) -> Iterator[Problem]:
    """Yield parameters that two coupled models do not support; nothing if there is a single model."""
    coupling = problem.dynamics.coupling
    if coupling is None:
        if problem.dynamics.solver == "dns":
            message = "replaces two coupled models, but the case has no coupling"
            yield Problem("dynamics.solver", message, "dns", f"explicit, implicit, both, or a table {COUPLING}")
        return
    yield from _fine(coupling, problem)
    yield from _scheme(coupling, problem)
    yield from _ranks(coupling, problem.dynamics.ranks)
    yield from _one_model(problem)


def _fine(coupling: LayerCoupling, problem: StructureProblem) -> Iterator[Problem]:
    layers = problem.structure.layers
    for name in coupling.fine:
        yield from unknown_name(f"{COUPLING}.fine", name, layers, "layer")
    if layers and set(coupling.fine) >= set(layers):
        yield Problem(f"{COUPLING}.fine", "leaves no layer to the macro model", list(coupling.fine), "fewer layers")
    if problem.structure.element != "hexahedron":
        yield Problem(
            COUPLING, f"couples hexahedra, but the element is {problem.structure.element}", None, "hexahedron"
        )


def _scheme(coupling: LayerCoupling, problem: StructureProblem) -> Iterator[Problem]:
    if coupling.direction == "one_way":
        message = "needs a coarse mesh of the fine part, which only a package has"
        yield Problem(f"{COUPLING}.direction", message, "one_way", "two_way")
    materials = {name: problem.known_materials.get(layer.material) for name, layer in problem.structure.layers.items()}
    plastic = [name for name, material in materials.items() if material and material.plasticity is not None]
    if coupling.scheme == "local_steps" and (plastic or problem.dynamics.kinematics != "small"):
        kinematics = f"dynamics.kinematics = {problem.dynamics.kinematics}"
        why = f"layers that yield: {', '.join(plastic)}" if plastic else kinematics
        message = f"needs elastic layers and small strains, but the case has {why}"
        yield Problem(f"{COUPLING}.scheme", message, "local_steps", "held_velocity, impulse, gravouil_combescure, auto")


def _ranks(coupling: LayerCoupling, ranks: int) -> Iterator[Problem]:
    if coupling.placement == "disjoint" and ranks < 2:
        message = "needs at least one rank for each model"
        yield Problem(f"{COUPLING}.placement", message, "disjoint", "auto, shared; dynamics.ranks >= 2")
    if coupling.macro_ranks is not None and coupling.placement != "disjoint":
        yield Problem(f"{COUPLING}.macro_ranks", "applies only to placement = disjoint", coupling.macro_ranks, "none")
    elif coupling.macro_ranks is not None and coupling.macro_ranks >= ranks:
        message = "leaves no rank for the meso model"
        yield Problem(f"{COUPLING}.macro_ranks", message, coupling.macro_ranks, f"< {ranks}, dynamics.ranks")


def _one_model(problem: StructureProblem) -> Iterator[Problem]:
    """Yield parameters that require a single model."""
    dynamics = problem.dynamics
    if dynamics.solver == "implicit":
        yield Problem(
            "dynamics.solver", "does not support coupling", "implicit", "explicit or both, or no dynamics.coupling"
        )
    if (
        dynamics.modes
        and dynamics.solver not in ("both", "dns")
        and not (dynamics.coupling and dynamics.coupling.compare)
    ):
        yield Problem("dynamics.modes", "require a single model", dynamics.modes, f"0, or {COUPLING}.compare = true")
    if dynamics.numerics.explicit_step is not None:
        message = "is the step of a single model; two models have a window and smaller steps"
        yield Problem("dynamics.numerics.explicit_step", message, f"{dynamics.numerics.explicit_step:g} s", "none")
    if dynamics.numerics.critical_step != "element":
        message = "requires a single model: windows are derived from the steps of elements"
        yield Problem("dynamics.numerics.critical_step", message, dynamics.numerics.critical_step, "element")
    for name, load in problem.loads.items():
        if load.is_large_mass:
            yield Problem(f"loads.{name}.method", "supports only a single model", "large_mass", "direct")
