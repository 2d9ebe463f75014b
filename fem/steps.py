"""Critical steps of the models, mass scaling, and the windows that follow."""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.body import Pieces
from fem.errors import AgreedError
from fem.estimate import WindowPlan, window_plan
from fem.parameters import Materials, Shock
from fem.scene import Tables


@dataclass(frozen=True, slots=True)
class Steps:
    """Time steps of a run and how they came about.

    Attributes:
        plan: Window, substeps.
        mass_factor: ``(ne,)`` density factor of this rank's elements.
        critical: Role -> smallest element critical step before mass scaling [s].
        cut: Smallest element critical step among those that touch the cut or belong to the macro model [s].
        added_mass: Mass that scaling adds [kg].
        model_mass: Mass without scaling [kg].
    """

    plan: WindowPlan
    mass_factor: NDArray[np.float64]
    critical: dict[str, float]
    cut: float
    added_mass: float
    model_mass: float


def choose_steps(world: MPI.Comm, pieces: Pieces, tables: Tables, shock: Shock) -> Steps:
    """Agree on steps and mass scaling over all models; collective.

    In a DNS run the elements of ``board`` take the place of the macro model, so that both modes use the same dt and
    sample at the same times.

    Raises:
        AgreedError: Every role is mass scaled.
    """
    numerics = shock.numerics
    scaled = np.isin(pieces.roles, numerics.mass_scaled)
    target = world.allreduce(float(pieces.steps[~scaled].min(initial=np.inf)), MPI.MIN)
    if not np.isfinite(target):
        raise AgreedError(f"shock.numerics.mass_scaled = {numerics.mass_scaled} leaves no role to take the step from")
    factor = np.where(scaled, np.maximum(1.0, (target / pieces.steps) ** 2), 1.0)
    steps = pieces.steps * np.sqrt(factor)
    slow = steps[is_macro(pieces, tables)].min(initial=np.inf)
    macro_step = world.allreduce(float(slow), MPI.MIN)
    meso_step = world.allreduce(float(steps.min(initial=np.inf)), MPI.MIN)
    if not np.isfinite(macro_step):
        macro_step = meso_step
    plan = window_plan(macro_step, meso_step, numerics.step_fraction, shock.duration, numerics.history_samples)
    mass = pieces.elements.density * pieces.geometry.volume
    return Steps(
        plan=plan,
        mass_factor=factor,
        critical=critical_by_role(world, pieces),
        cut=macro_step,
        added_mass=world.allreduce(float(mass @ (factor - 1.0))),
        model_mass=world.allreduce(float(mass.sum())),
    )


def is_macro(pieces: Pieces, tables: Tables) -> NDArray[np.bool_]:
    """Return ``(ne,)``: elements of the macro model, and those whose nodes the cut touches."""
    macro = np.array([name == "board" for name in tables.part_names])[pieces.parts]
    at_cut = np.isin(pieces.local.nodes[pieces.elements.cells], tables.cut).any(axis=1)
    return macro | at_cut


def critical_by_role(world: MPI.Comm, pieces: Pieces) -> dict[str, float]:
    """Return the smallest element critical step [s] of each material role over all ranks."""
    found = {}
    for role in Materials.model_fields:
        step = world.allreduce(float(pieces.steps[pieces.roles == role].min(initial=np.inf)), MPI.MIN)
        if np.isfinite(step):
            found[role] = step
    return found
