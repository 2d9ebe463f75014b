"""Critical steps of the models, mass scaling, and the windows that follow."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.body import Pieces
from fem.communicators import Role
from fem.errors import AgreedError
from fem.estimate import WindowPlan, window_plan
from fem.material_roles import Materials
from fem.parameters import Shock
from fem.scene import Tables


@dataclass(frozen=True, slots=True)
class Steps:
    """Time steps of a run and how they came about.

    Attributes:
        plan: Window, substeps.
        mass_factors: Per model of this rank the density factor ``(ne,)`` of its elements.
        critical: Role -> smallest element critical step before mass scaling [s].
        cut: Smallest element critical step among those that touch the cut or belong to the macro model [s].
        added_mass: Mass that scaling adds [kg].
        model_mass: Mass without scaling [kg].
    """

    plan: WindowPlan
    mass_factors: list[NDArray[np.float64]]
    critical: dict[str, float]
    cut: float
    added_mass: float
    model_mass: float

    def step_of(self, role: Role) -> float:
        """Return the time step of a model [s]."""
        return self.plan.window if role == "macro" else self.plan.step


def choose_steps(world: MPI.Comm, models: Sequence[tuple[Pieces, Tables]], shock: Shock) -> Steps:
    """Agree on steps and mass scaling over all models; collective.

    In a DNS run the elements of ``board`` take the place of the macro model, so that both modes use the same dt and
    sample at the same times.

    Args:
        world: Communicator of all models.
        models: The models of this rank.
        shock: Duration and numerics.

    Raises:
        AgreedError: Every role is mass scaled.
    """
    numerics = shock.numerics
    unscaled = [pieces.steps[~np.isin(pieces.roles, numerics.mass_scaled)] for pieces, _ in models]
    target = agreed_minimum(world, unscaled)
    if not np.isfinite(target):
        raise AgreedError(f"shock.numerics.mass_scaled = {numerics.mass_scaled} leaves no role to take the step from")
    factors = [mass_factor(pieces, numerics.mass_scaled, target) for pieces, _ in models]
    steps = [pieces.steps * np.sqrt(factor) for (pieces, _), factor in zip(models, factors, strict=True)]
    meso_step = agreed_minimum(world, steps)
    slow = [some[is_macro(pieces, tables)] for (pieces, tables), some in zip(models, steps, strict=True)]
    macro_step = agreed_minimum(world, slow)
    if not np.isfinite(macro_step):
        macro_step = meso_step
    masses = [pieces.elements.density * pieces.geometry.volume for pieces, _ in models]
    added = sum(float(mass @ (factor - 1.0)) for mass, factor in zip(masses, factors, strict=True))
    return Steps(
        plan=window_plan(macro_step, meso_step, numerics.step_fraction, shock.duration, numerics.history_samples),
        mass_factors=factors,
        critical=critical_by_role(world, [pieces for pieces, _ in models]),
        cut=macro_step,
        added_mass=world.allreduce(added),
        model_mass=world.allreduce(sum(float(mass.sum()) for mass in masses)),
    )


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
