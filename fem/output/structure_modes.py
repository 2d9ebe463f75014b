"""Output of natural modes: frequencies in ``modes.json``, mode shapes for ParaView."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.structure_tables import shaken_supports
from reflowshock.fem.dynamics.modal import Modes, natural_modes
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.output.fields import Fields
from reflowshock.fem.problem.fittings import AXES
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.problem.load_kinds import PrescribedMotion
from reflowshock.fem.setup.structure_models import StructureModel

SCALE = 0.05  # largest displacement of a mode shape in a field file, relative to the length of the structure


@dataclass(frozen=True, slots=True)
class ModeTable:
    """Natural frequencies and mass fractions.

    Attributes:
        frequency: Natural frequencies in ascending order, shape (k,) [Hz].
        mass_fraction: Effective modal mass over total mass for base excitation along x, y, z, shape (k, 3).
    """

    frequency: NDArray[np.float64]
    mass_fraction: NDArray[np.float64]


def find_modes(comm: MPI.Comm, model: StructureModel, mass: float, request: StructureInput) -> ModeTable:
    """Compute the natural modes of a structure, and write ``modes.json`` and the shapes ``modes.pvd``; collective.

    Args:
        comm: Communicator of all ranks.
        model: Model of the structure on this rank.
        mass: Mass of the structure [kg].
        request: Input of the run, with the number of modes and the output folder.

    Returns:
        Natural frequencies [Hz] and fractions of the mass along x, y, z, in ascending order of frequency.

    Raises:
        AgreedError: More modes are requested than there are equations, or too few converged; on every rank.
    """
    body = _at_rest_supports(model, request)
    try:
        modes = natural_modes(Equations.of(comm, body), request.dynamics.modes)
    except ValueError as error:  # every rank counts the same equations
        raise AgreedError(f"dynamics.modes: {error}") from error
    table = ModeTable(modes.frequency, modes.effective_mass / mass)
    if comm.rank == 0:
        write_modes(request.output, table)
    _write_shapes(comm, replace(model, body=body), request, modes)
    return table


def _at_rest_supports(model: StructureModel, request: StructureInput) -> Body:
    """Return the body with all nodes fixed that a large mass or a prescribed motion moves."""
    moved = [(request.supports[name].on, slice(None)) for name in shaken_supports(request)]
    loads = [load for load in request.loads.values() if isinstance(load, PrescribedMotion)]
    free = model.body.free.copy()
    for on, components in [*moved, *((load.on, AXES.index(load.component)) for load in loads)]:
        nodes = model.body.local.locate(model.tables.nodes_of[on])
        free[nodes[nodes >= 0], components] = False
    return replace(model.body, free=free)


def write_modes(folder: Path, table: ModeTable) -> None:
    """Write the table of modes as ``modes.json`` into a folder; not collective.

    The file is a list of dictionaries with ``mode`` (number from 1), ``frequency`` [Hz] and ``mass_fraction``, a
    dictionary with the keys ``x``, ``y`` and ``z``.

    Args:
        folder: Existing folder.
        table: Natural frequencies and mass fractions.
    """
    (folder / "modes.json").write_text(json.dumps(_mode_rows(table), indent=1), encoding="utf-8")


def _mode_rows(table: ModeTable) -> list[dict[str, Any]]:
    """Return the modes as records of number, frequency [Hz] and mass fraction along x, y, z."""
    return [
        {
            "mode": number,
            "frequency": float(frequency),
            "mass_fraction": dict(zip("xyz", fraction.tolist(), strict=True)),
        }
        for number, (frequency, fraction) in enumerate(zip(table.frequency, table.mass_fraction, strict=True), start=1)
    ]


def _write_shapes(comm: MPI.Comm, model: StructureModel, request: StructureInput, modes: Modes) -> None:
    """Write ``modes.pvd`` with the scaled shape of mode k at "time" k; collective."""
    part = model.tables.part[model.body.local.cell_numbers]
    fields = Fields(comm, model.body, part, request.output / "modes.pvd")
    for number, shape in enumerate(modes.shape, start=1):
        largest = comm.allreduce(float(np.abs(shape).max(initial=0.0)), MPI.MAX)
        fields.write(fields.sample(shape * (SCALE * request.structure.length / largest), float(number)))
    fields.close()
