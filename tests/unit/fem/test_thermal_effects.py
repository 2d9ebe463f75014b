"""Neglected reflow effects change the gaps by less than the threshold, with conservative estimates."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import GAP
from reflowshock.cases.hard.trials.packages import MM, board, package
from reflowshock.effect import decide_all
from reflowshock.fem.estimates.thermal_effects import (
    HEATED_EFFECTS,
    NEGLIGIBLE,
    Heated,
    PackageSizes,
    solder_force_number,
    warpage_number,
)
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.pads import Pads
from reflowshock.fem.statics.plates import RigidPlates
from reflowshock.fem.statics.state import Assembly
from reflowshock.fem.statics.structure import ThermalStructure
from reflowshock.materials.library import FR4, SILICON
from reflowshock.materials.roles import ELASTIC, Materials
from reflowshock.meshing.board.assembly import write_heated_assembly
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from tests.support.thermal_models import REFERENCE, Layers, pads_at, small_structure, structure_of

SIZES = PackageSizes(
    board=1e-3,
    substrate=0.4e-3,
    die=0.4e-3,
    die_reach=np.hypot(2e-3, 2e-3),
    reach=np.hypot(1.5e-3, 1.5e-3),
    pitch=1e-3,
    pad_radius=0.2e-3,
    standoff=GAP,
)
ALIKE = FR4.model_copy(update={"thermal_expansion_in_plane": 15.9e-6})


def gaps(structure, temperature: float, wrenches=None) -> np.ndarray:
    """Return the change of each gap at a temperature [K], shape (joints, 3) [m]."""
    modes = structure.rigid_modes
    wrenches = np.zeros(modes.pad_motion.shape[1:]) if wrenches is None else wrenches
    motion = structure.solve(temperature, 0.0, wrenches, np.zeros(len(modes.names))).pad_motion
    return motion[:, 1, :3] - motion[:, 0, :3]


@pytest.mark.parametrize(("die", "flexible"), [(SILICON, True), (ALIKE, False)])
def test_warpage_stays_below_its_number(tmp_path, die, flexible):
    assembly, thermal = small_structure(tmp_path), Thermal()
    materials = Materials(die=die)
    number = warpage_number(thermal, materials.by_role, SIZES)
    assert (number > NEGLIGIBLE) == flexible
    structure = ThermalStructure.build(MPI.COMM_SELF, replace(assembly, materials=materials))
    change = gaps(structure, thermal.peak) - gaps(structure, REFERENCE)
    spread = np.ptp(change[:, 2]) / GAP, np.abs(change[:, :2]).max() / SIZES.pad_radius
    assert max(spread) < number
    assert max(spread) > 0.2 * number
    if not flexible:
        assert max(spread) < NEGLIGIBLE


@pytest.mark.parametrize(("tension", "acts"), [(0.5, False), (500.0, True)])
def test_bending_by_the_solder_stays_below_its_number(tmp_path, tension, acts):
    materials, pull = ELASTIC, 2.0 * np.pi * SIZES.pad_radius * tension
    number = solder_force_number(materials.by_role, SIZES, tension)
    assert (number > NEGLIGIBLE) == acts
    structure = ThermalStructure.build(MPI.COMM_SELF, small_structure(tmp_path))
    changes = []
    for signs in itertools.product((-1.0, 1.0), repeat=4):
        if sum(signs) == 0.0:  # as in any equilibrium except for the weight
            wrenches = np.zeros((4, 2, 6))
            wrenches[:, 0, 2], wrenches[:, 1, 2] = pull * np.array(signs), -pull * np.array(signs)
            changes.append(np.ptp((gaps(structure, REFERENCE, wrenches) - gaps(structure, REFERENCE))[:, 2]))
    assert 0.2 * number * GAP < max(changes) < number * GAP


def test_switches_are_followed_and_rigid_plates_take_no_force():
    roles = ELASTIC.by_role

    def decide(thermal: Thermal, surface_tension: float) -> dict:
        return decide_all(HEATED_EFFECTS, Heated(thermal, roles, SIZES, surface_tension, [thermal.peak]))

    auto = decide(Thermal(), 0.5)
    assert {name: effect["on"] for name, effect in auto.items()} == {
        "thermal": True,
        "flexible": True,
        "solder_force": False,
        "residual_stress": False,
    }
    assert "<= 0.001" in auto["solder_force"]["why"]
    off = decide(Thermal.model_validate({"effects": {"flexible": "off", "solder_force": "on"}}), 0.5)
    assert not off["flexible"]["on"]
    assert off["solder_force"] == {"on": False, "why": "board and package are rigid"}
    cold = Thermal.model_validate(dict.fromkeys(("peak", "melting", "solidification"), 298.15))
    assert not decide(cold, 0.5)["flexible"]["on"]
    assert decide(cold, 500.0)["flexible"]["on"]


def test_rigid_plates_have_the_motions_and_weights_of_elastic_ones(tmp_path):
    assembly = small_structure(tmp_path)
    elastic, rigid = ThermalStructure.build(MPI.COMM_SELF, assembly), RigidPlates(assembly)
    assert rigid.rigid_modes.names == elastic.rigid_modes.names
    assert rigid.rigid_modes.weight == pytest.approx(elastic.rigid_modes.weight, rel=1e-12)
    assert np.array_equal(rigid.points, elastic.points)
    wrenches = np.random.default_rng(0).normal(size=(4, 2, 6))
    state = rigid.solve(473.15, 0.0, wrenches, np.array([1e-5]))
    assert state.pad_motion == pytest.approx(1e-5 * elastic.rigid_modes.pad_motion[0], abs=1e-15)
    assert rigid.rigid_modes.imbalance(wrenches) == pytest.approx(elastic.rigid_modes.imbalance(wrenches))


def test_rigid_plates_are_moved_by_the_corner(tmp_path):
    assembly = small_structure(tmp_path, package="moved", corner_displacement=-1e-4)
    rigid, elastic = RigidPlates(assembly), ThermalStructure.build(MPI.COMM_SELF, assembly)
    wrenches = 1e-4 * np.random.default_rng(0).normal(size=(4, 2, 6))
    state = rigid.solve(473.15, -1e-4, wrenches, np.zeros(0))
    assert state.pad_motion[:, 1] == pytest.approx(np.tile([0.0, 0.0, -1e-4, 0.0, 0.0, 0.0], (4, 1)), abs=1e-14)
    assert state.corner_force == pytest.approx(
        elastic.solve(473.15, -1e-4, wrenches, np.zeros(0)).corner_force, rel=1e-9
    )


def test_a_whole_package_is_held_level_by_four_corners(tmp_path):
    (tmp_path / "small").mkdir()
    mesh = Layers(8e-3, 6e-3, (0.4e-3, 0.4e-3), (4, 3, 1, 1)).mesh(())
    pads = pads_at([(1e-3, 1e-3), (3e-3, 2e-3)], 0.3e-3)
    thermal = {"package": "moved", "corner_displacement": 1e-4}
    elastic = structure_of(mesh, tmp_path, pads, {}, thermal)
    whole = {"mesh": tmp_path / "assembly.msh", "pads": pads}
    rigid = RigidPlates(replace(small_structure(tmp_path / "small"), **whole))
    held = RigidPlates(replace(small_structure(tmp_path / "small", 0.0, **thermal), **whole))
    assert rigid.rigid_modes.names == ("x", "y", "z", "turn_x", "turn_y", "turn_z")
    assert elastic.rigid_modes.names == ("x", "y", "turn_z")
    load = np.zeros((2, 2, 6))
    load[:, 1, 2] = 1e-3, 3e-3
    corners = np.array([(4e-3, 3e-3), (4e-3, 0.0), (0.0, 3e-3), (0.0, 0.0)])
    for structure in (elastic, held):
        force = structure.solve(REFERENCE, 1e-4, load, np.zeros(3)).corner_force
        assert force.sum() == pytest.approx(-4e-3)
        assert force @ corners == pytest.approx(-load[:, 1, 2] @ pads.centres[:, 1, :2])


@pytest.mark.parametrize(
    ("side", "thickness"),
    [(8.0, 0.4), pytest.param(6.0, 0.775, marks=pytest.mark.long), pytest.param(4.0, 0.4, marks=pytest.mark.long)],
)
def test_warpage_of_a_package_with_a_ring_of_substrate_around_its_die(tmp_path, side, thickness):
    parts = package(
        rows=10,
        columns=10,
        substrate={"length": 11.0 * MM, "width": 11.0 * MM, "thickness": 0.4 * MM},
        die={"length": side * MM, "width": side * MM, "thickness": thickness * MM},
    )
    plate = board(length=60.0 * MM, width=50.0 * MM)
    write_heated_assembly(parts, plate, tmp_path / "heated.msh")
    lower = np.array([(site.x, site.y, site.z_board) for site in pad_table(parts, plate, Warpage())])
    centres = np.stack([lower, lower + [0.0, 0.0, parts.standoff]], axis=1)
    pads = Pads([str(number) for number in range(len(lower))], centres, np.full((len(lower), 2), 0.24 * MM))
    sizes = replace(SIZES, die=thickness * MM, reach=np.hypot(4.5, 4.5) * MM, standoff=parts.standoff)
    structure = ThermalStructure.build(
        MPI.COMM_SELF, Assembly(tmp_path / "heated.msh", pads, ELASTIC, Thermal(), gravity=9.81)
    )
    change = gaps(structure, Thermal().peak) - gaps(structure, REFERENCE)
    number = warpage_number(Thermal(), ELASTIC.by_role, sizes)
    assert 0.4 * number < np.ptp(change[:, 2]) / parts.standoff < number
