"""Critical steps of the models, mass scaling, and the windows that follow."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.body import Pieces, make_body
from fem.communicators import Role
from fem.errors import AgreedError
from fem.estimate import WindowPlan, damped_critical_step, window_plan
from fem.materials.roles import Materials
from fem.parameters import Shock
from fem.power_iteration import highest_frequency
from fem.scene import Tables


@dataclass(frozen=True, slots=True)
class Steps:
    """Time steps of a run and how they came about.

    Attributes:
        plan: Window, substeps.
        mass_factors: Per model of this rank the density factor ``(ne,)`` of its elements.
        critical: Role -> smallest element critical step before mass scaling [s].
        smallest: Smallest critical step that the substeps follow, mass scaling and damping included [s].
        cut: Smallest element critical step among those that touch the cut or belong to the macro model [s].
        added_mass: Mass that scaling adds [kg].
        model_mass: Mass without scaling [kg].
    """

    plan: WindowPlan
    mass_factors: list[NDArray[np.float64]]
    critical: dict[str, float]
    cut: float
    smallest: float
    added_mass: float
    model_mass: float

    def step_of(self, role: Role) -> float:
        """Return the time step of a model [s]."""
        return self.plan.window if role == "macro" else self.plan.step


def choose_steps(
    world: MPI.Comm, models: Mapping[Role, tuple[Pieces, Tables]], shock: Shock, comms: Mapping[Role, MPI.Comm]
) -> Steps:
    """Agree on steps and mass scaling over all models; collective.

    In a DNS run the elements of ``board`` take the place of the macro model, so that both modes sample at the same
    times. The window always follows the elements at the cut; power iteration lets the substeps of a DNS be larger.

    Args:
        world: Communicator of all models.
        models: The models of this rank.
        shock: Duration and numerics.
        comms: Their communicators.

    Raises:
        AgreedError: Every role is mass scaled.
    """
    numerics, pieces = shock.numerics, [item for item, _ in models.values()]
    factors = mass_factors(world, pieces, numerics.mass_scaled)
    steps = [item.steps * np.sqrt(factor) for item, factor in zip(pieces, factors, strict=True)]
    meso_step = agreed_minimum(world, steps)
    if "dns" in models and numerics.critical_step == "power_iteration":
        meso_step = max(meso_step, assembled_step(comms["dns"], models["dns"], factors[0]))
    slow = [some[is_macro(*model)] for model, some in zip(models.values(), steps, strict=True)]
    macro_step = agreed_minimum(world, slow)
    macro_step = macro_step if np.isfinite(macro_step) else meso_step
    macro_step, meso_step = (
        damped_critical_step(step, shock.damping.coefficients[1]) for step in (macro_step, meso_step)
    )
    masses = [item.elements.density * item.geometry.volume for item in pieces]
    added = sum(float(mass @ (factor - 1.0)) for mass, factor in zip(masses, factors, strict=True))
    return Steps(
        plan=window_plan(macro_step, meso_step, numerics.step_fraction, shock.duration, numerics.history_samples),
        mass_factors=factors,
        critical=critical_by_role(world, pieces),
        cut=macro_step,
        smallest=meso_step,
        added_mass=world.allreduce(added),
        model_mass=world.allreduce(sum(float(mass.sum()) for mass in masses)),
    )


def assembled_step(comm: MPI.Comm, model: tuple[Pieces, Tables], mass_factor: NDArray[np.float64]) -> float:
    """Return the critical step [s] of a whole model from its highest frequency, elastic at small strains; collective.

    With the certainty of ``power_iteration`` it is not above the true one. It is not for the models of a window, whose
    stability rests on the steps of elements: at the assembled step of a meso model of one joint a window grew by 13 %.
    """
    body = make_body(comm, *model, mass_factor, None)
    found = highest_frequency(comm, body, body.terms, body.mass)
    body.shared.free()
    return found.critical_step


def mass_factors(world: MPI.Comm, pieces: Sequence[Pieces], scaled: Sequence[str]) -> list[NDArray[np.float64]]:
    """Return per model the density factor ``(ne,)`` that raises the steps of some roles to the others'; collective.

    Raises:
        AgreedError: Every role is mass scaled.
    """
    target = agreed_minimum(world, [item.steps[~np.isin(item.roles, scaled)] for item in pieces])
    if not np.isfinite(target):
        raise AgreedError(f"shock.numerics.mass_scaled = {tuple(scaled)} leaves no role to take the step from")
    return [mass_factor(item, scaled, target) for item in pieces]


def agreed_minimum(world: MPI.Comm, values: Sequence[NDArray[np.float64]]) -> float:
    """Return the smallest of all values of all ranks, infinity where there is none; collective."""
    return float(world.allreduce(min(float(some.min(initial=np.inf)) for some in values), MPI.MIN))


def mass_factor(pieces: Pieces, scaled: Sequence[str], target: float) -> NDArray[np.float64]:
    """Return the density factor ``(ne,)`` that raises the critical steps of some roles to ``target`` [s]."""
    return np.where(np.isin(pieces.roles, scaled), np.maximum(1.0, (target / pieces.steps) ** 2), 1.0)


def is_macro(pieces: Pieces, tables: Tables) -> NDArray[np.bool_]:
    """Return ``(ne,)``: elements of the macro model, and those whose nodes the cut touches."""
    macro = np.array([name == "board" for name in tables.part_names])[pieces.parts]
    at_cut = np.isin(pieces.local.nodes[pieces.elements.cells], tables.cut).any(axis=1)
    return macro | at_cut


def critical_by_role(
    world: MPI.Comm, models: Sequence[Pieces], roles: Iterable[str] = tuple(Materials.model_fields)
) -> dict[str, float]:
    """Return the smallest element critical step [s] of each material role over all ranks."""
    found = {role: agreed_minimum(world, [pieces.steps[pieces.roles == role] for pieces in models]) for role in roles}
    return {role: step for role, step in found.items() if np.isfinite(step)}
