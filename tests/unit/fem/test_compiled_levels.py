"""Substeps of levels in one compiled call give the same result as single substeps."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.step_levels import SubsteppedElements, levels_of
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_levels import joint_on_board, levelled


def barrel() -> MeshData:
    """Return a barrel-shaped joint on a board, without box elements."""
    mesh = joint_on_board()
    joint = np.unique(mesh.cells[mesh.in_parts(lambda name: "@" in name)])
    height, axis = mesh.points[joint, 2], np.array([0.5e-3, 0.5e-3])
    bulge = 1.0 + 0.2 * np.sin(np.pi * height / height.max())
    mesh.points[joint, :2] = axis + bulge[:, None] * (mesh.points[joint, :2] - axis)
    return mesh


def one_by_one(level: SubsteppedElements) -> SubsteppedElements:
    """Return a level that executes its substeps and the substeps of its inner levels one by one."""
    terms = [one_by_one(term) if isinstance(term, SubsteppedElements) else term for term in level.terms]
    return replace(level, terms=terms, compiled=())


def nested(level: SubsteppedElements) -> list[SubsteppedElements]:
    """Return a level and the levels inside it."""
    return [level, *(inner for term in levels_of(level.terms) for inner in nested(term))]


@pytest.mark.parametrize(
    ("ratios", "calls"), [((12,), [1]), ((7, 3), [2, 1]), ((4, 3, 3), [0, 2, 1])], ids=["one", "two", "boxes outside"]
)
def test_all_substeps_at_once_are_those_one_by_one(ratios, calls):
    body = levelled(barrel(), ELASTIC, ratios).body
    (level,) = levels_of(body.terms)
    assert [len(item.compiled) for item in nested(level)] == calls
    displacement = 1e-6 * np.sin(np.arange(body.mass.size * 3.0)).reshape(-1, 3)
    body.tie.spread(displacement)
    together, apart = np.zeros_like(displacement), np.zeros_like(displacement)
    for _ in range(2):  # the second call checks that no state remains from the first
        level.add(displacement, together)
        one_by_one(level).add(displacement, apart)
    assert np.abs(apart).max() > 0.0
    assert np.abs(together - apart).max() <= 1e-14 * np.abs(apart).max()
    assert not level.state[1:].any()


def test_levels_follow_the_motion_in_either_way():
    """Fixed nodes of a motion are also fixed in the arrays of the compiled call."""
    (level,) = levels_of(levelled(barrel(), ELASTIC, (7, 3)).body.terms)
    before = level.compiled[0][3].copy()
    level.follow(np.full((int(level.rows.max()) + 1, 3), 2.0))
    assert level.compiled[0][3] is level.inverse
    assert not np.array_equal(before, level.compiled[0][3])
    assert level.compiled[1][3] is levels_of(level.terms)[0].inverse
