"""Columns of split tetrahedra against swept hexahedra: bending, vibration and critical step."""

from dataclasses import dataclass

import numpy as np
import pytest

from reflowshock.cases.hard.trials.boxes import KINDS, elements_of, frequencies, solve
from reflowshock.cases.hard.trials.packages import MM
from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.fem.cell_shape import TENSOR_ORDER
from reflowshock.fem.elements.element import critical_steps, element_geometry
from reflowshock.fem.estimates.estimate import box_critical_step
from reflowshock.materials.library import LIBRARY
from reflowshock.meshing.board.parameters import JointNumerics
from reflowshock.meshing.core.hexahedra import quad_areas, shortest_lengths
from reflowshock.meshing.joint.free_form import free_form_solder
from reflowshock.meshing.joint.solder import Solder
from reflowshock.meshing.joint.swept import swept_solder
from reflowshock.meshing.joint.tetrahedra import fill_in_process

SOLDER = LIBRARY["SAC405"]
COLUMN = barrel(0.45 * MM, 0.03 * MM)


@dataclass(frozen=True, slots=True)
class Answer:
    """Deflection under a side load [m], first frequency [Hz], exact and estimated critical step [s]."""

    deflection: float
    frequency: float
    step: float
    estimate: float


def answer(solder: Solder) -> Answer:
    """Evaluate a solder column clamped at its foot."""
    elements = elements_of(
        KINDS["incompatible_modes"], solder.points, solder.cells[:, TENSOR_ORDER].astype(np.int32), [SOLDER]
    )
    held, load = np.zeros((2, *solder.points.shape))
    held[np.unique(solder.faces[0].quads)] = 1.0
    quads = solder.faces[1].quads
    areas = quad_areas(solder.points, quads)
    np.add.at(load[:, 0], quads, (0.25 * areas / areas.sum())[:, None])
    moved = solve(elements, np.zeros_like(load), held.astype(bool), load)
    volumes = element_geometry(elements.points, elements.cells).nodal_volume
    shortest = float(shortest_lengths(solder.points, solder.cells).min())
    return Answer(
        float((load * moved).sum()),
        float(frequencies(elements, held.astype(bool), 1)[0]),
        float(critical_steps(elements, volumes).min()),
        box_critical_step(SOLDER, np.full(3, shortest)),
    )


def swept(core: int, rings: int, layers: int) -> Answer:
    """Return the answer of a column of swept hexahedra, from its mesh settings."""
    return answer(swept_solder(COLUMN, JointNumerics(core=core, rings=rings, layers=layers), np.asarray))


@pytest.fixture(scope="module")
def answers() -> dict[str, Answer]:
    """Return answers at the intended resolution, swept and split, and with fine swept hexahedra."""
    split = free_form_solder(COLUMN, fill_in_process(COLUMN, 0.16 * MM, False), np.asarray)
    return {"split": answer(split), "swept": swept(2, 1, 6), "exact": swept(4, 2, 14)}


@pytest.mark.long
def test_split_column_has_the_stiffness_and_frequency_of_fine_hexahedra(answers):
    split, exact = answers["split"], answers["exact"]
    assert split.deflection == pytest.approx(exact.deflection, rel=0.02)
    assert split.frequency == pytest.approx(exact.frequency, rel=0.01)


def test_split_column_is_as_accurate_as_swept_hexahedra(answers):
    split, swept, exact = (answers[name] for name in ("split", "swept", "exact"))
    assert abs(split.deflection / exact.deflection - 1.0) < abs(swept.deflection / exact.deflection - 1.0)
    assert abs(split.frequency / exact.frequency - 1.0) < abs(swept.frequency / exact.frequency - 1.0)


def test_critical_step_is_smaller_and_not_overestimated(answers):
    split, swept = answers["split"], answers["swept"]
    assert 0.05 * swept.step < split.step < swept.step
    assert 0.3 * split.step < split.estimate < split.step
