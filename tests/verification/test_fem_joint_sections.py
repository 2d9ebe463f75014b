"""Section forces and layer averages of a solder column: exact resultants, rate of momentum, exact fields."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.division.tables import join_meshes, model_inputs
from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.loads.load import BodyAcceleration, NodalForces
from reflowshock.fem.loads.pulse import Constant
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.output.watch_joints import JointWatch
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.library import SAC405
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import Materials
from tests.support.fem_bodies import dense_stiffness

SIDE, HEIGHT, PAD = 0.4e-3, 0.3e-3, 0.05e-3
MIDDLE = np.array([0.0, 0.0, HEIGHT / 2])
LEVELS, ELASTICALLY = np.linspace(0.0, HEIGHT, 5), ForceOptions()
ELASTIC = Isotropic(density=7400.0, young_modulus=40e9, poisson_ratio=0.3)
ZERO = Isotropic(density=7400.0, young_modulus=40e9, poisson_ratio=0.0)


def column(held: bool, copper: bool, edges: int = 3, levels=LEVELS, bulge: float = 0.0):
    """Return a solder column, with optional copper pads and an optional clamp at its lowest face."""
    side = np.linspace(-SIDE / 2, SIDE / 2, edges + 1)
    z = np.concatenate([[-PAD], levels, [HEIGHT + PAD]]) if copper else levels
    points, cells = grid(side, side, z)
    centre = points[cells].mean(axis=1)[:, 2]
    solder = (centre > 0) & (centre < HEIGHT)
    facets = {"mounting_holes": on(2, z[0])} if held else {}
    points[:, :2] *= 1.0 + bulge * np.sin(np.pi * np.clip(points[:, 2:] / HEIGHT, 0.0, 1.0))
    mesh = mesh_of(points, cells, np.where(solder, "solder@A1", "copper@A1"), facets)
    for end, level in (("board", 0), ("package", len(levels) - 1)):
        plane = np.flatnonzero(np.abs(points[:, 2] - levels[level]) < 1e-9).reshape(edges + 1, edges + 1)
        corners = plane[:-1, :-1], plane[:-1, 1:], plane[1:, 1:], plane[1:, :-1]
        mesh.facets[f"pad_{end}@A1"] = np.stack([item.ravel() for item in corners], axis=1).astype(np.int32)
    return mesh


def watched(mesh, solder, response=ELASTICALLY, formulation="incompatible_modes", layer=25e-6):
    """Return body, watch and critical step of a mesh on one rank."""
    item = model_inputs(join_meshes(mesh), "dns", layer=layer)["dns"]
    materials = Materials(solder=solder)
    rank_elements = make_rank_elements(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials, formulation)
    body = make_body(MPI.COMM_SELF, rank_elements, item.tables, np.ones(len(rank_elements.steps)), response)
    return body, JointWatch(item.tables, body, solder.plasticity is not None), rank_elements.steps.min()


def row_of(watch, motion):
    """Return the values of a sample on one rank."""
    return watch.row(*watch.sample(motion))


@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
@pytest.mark.parametrize("component", range(6))
def test_resultants_of_each_load_are_exact_at_both_ends(formulation, component):
    """The loads are axial force, shear, torsion and bending; upper shear bends the lower end by its height."""
    body, watch, step = watched(column(held=True, copper=False), ELASTIC, formulation=formulation)
    points, free = body.local.points, body.free.ravel()
    top = np.flatnonzero(points[:, 2] > HEIGHT - 1e-9)
    arm = points[top] - [0.0, 0.0, HEIGHT]
    unit = np.zeros(6)
    unit[component] = 1.0
    axial, shear_x, shear_y, torsion, bending_x, bending_y = unit
    force = np.tile([shear_x, shear_y, axial], (len(top), 1)) / len(top)
    force += np.cross([0.0, 0.0, torsion], arm) / np.sum(arm[:, :2] ** 2)
    force[:, 2] += (bending_x * arm[:, 1] - bending_y * arm[:, 0]) / np.sum(arm[:, 0] ** 2)
    load = NodalForces.build(body, body.local.nodes[top], force, Constant(1.0))
    motion = motion_of(body, step, [load])
    right = np.zeros_like(points)
    right[top] = force
    motion.displacement.reshape(-1)[free] = np.linalg.solve(
        dense_stiffness(body)[np.ix_(free, free)], right.ravel()[free]
    )
    motion.update_force()
    row = row_of(watch, motion)
    assert row["section_package"][0] == pytest.approx(unit, abs=1e-9)
    bent = unit + HEIGHT * np.array([0, 0, 0, 0, -shear_y, shear_x])
    assert row["section_board"][0] == pytest.approx(bent, abs=1e-9)
    assert row["peel_package"][0] == pytest.approx(axial / SIDE**2, abs=1e-9 / SIDE**2)
    modulus = SIDE**4 / 12.0 / (SIDE / np.sqrt(2.0))
    fibre = axial / SIDE**2 + np.hypot(bending_x, bending_y) / modulus
    assert row["outer_fibre_package"][0] == pytest.approx(fibre, rel=1e-9, abs=1e-9 / SIDE**2)


@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
@pytest.mark.parametrize(
    ("kinematics", "bulge"), [("small", 0.0), ("corotational", 0.0), ("corotational", 0.2), ("finite", 0.0)]
)
@pytest.mark.parametrize("solder", [ELASTIC, SAC405], ids=["elastic", "yields"])
def test_sections_balance_the_rate_of_momentum(formulation, kinematics, bulge, solder):
    """Section forces of a shaking, rotating and yielding column equal the momentum rate from half-step velocities.

    Strain rates are 2e4 1/s, spins 1e4 rad/s. Five times that spin leaves 3e-6 of moment where fully integrated
    elements flow at finite strain: their modes are not quite in equilibrium.
    """
    mesh = column(held=True, copper=True, bulge=bulge)
    body, watch, critical = watched(mesh, solder, ForceOptions(kinematics, 1e-9), formulation)
    motion = motion_of(body, 0.5 * critical, [BodyAcceleration(np.array([0.6, 0.0, 0.8]), Constant(1e6))])
    thrown = np.cross([2e3, -8e3, 8e3], body.local.points)
    thrown[:, 2] += 2e4 * (body.local.points[:, 2] + PAD)
    motion.velocity += np.where(body.free, thrown, 0.0)
    mass = solder_mass(body, solder.density)
    residuals, forces = [], []
    for k in range(160):
        motion.advance()
        motion.update_force()
        if k % 40:
            continue
        row = row_of(watch, motion)
        assert np.array_equal(row_of(watch, motion)["section_board"], row["section_board"])  # evaluation has no effect
        before = motion.velocity.copy()
        after = before + motion.step * motion.acceleration()
        position = body.local.points + (motion.displacement if kinematics != "small" else 0.0)
        rate = mass[:, None] * ((after - before) / motion.step - motion.gravity)
        needed = np.concatenate([rate.sum(axis=0), np.cross(position - MIDDLE, rate).sum(axis=0)])
        load = load_of(row, "package", *frame_of(mesh, body, position, "package"))
        load -= load_of(row, "board", *frame_of(mesh, body, position, "board"))
        residuals += [*np.abs(load - needed) / [1, 1, 1, HEIGHT, HEIGHT, HEIGHT], row["section_imbalance"][0]]
        forces += [*np.abs(row["section_board"][0, :3])]
    assert max(forces) > 0.1
    assert max(residuals) < 1e-6 * max(forces)
    if solder is SAC405:
        assert row["plastic_work_board"][0] > 1e3


def solder_mass(body, density):
    """Return the solder mass of each node, shape (n,) [kg]."""
    height = body.local.points[body.elements.cells][:, :, 2].mean(axis=1)
    chosen, mass = (height > 0.0) & (height < HEIGHT), np.zeros(len(body.mass))
    np.add.at(mass, body.elements.cells[chosen], density * body.geometry.nodal_volume[chosen])
    return mass


def load_of(row, end, frame, centre):
    """Return force and moment about the middle from the resultants at one end, shape (6,)."""
    axial, shear_x, shear_y, torsion, bending_x, bending_y = row[f"section_{end}"][0]
    force, moment = frame.T @ [shear_x, shear_y, axial], frame.T @ [bending_x, bending_y, torsion]
    return np.concatenate([force, moment + np.cross(centre - MIDDLE, force)])


def frame_of(mesh, body, position, end):
    """Return frame and centre of a pad face with nodes at ``position``, from its triangles."""
    local = body.local.locate(mesh.facets[f"pad_{end}@A1"].ravel()).reshape(-1, 4)
    corners = position[local]
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    normals = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    axis = normals.sum(axis=0) / np.linalg.norm(normals.sum(axis=0))
    first = np.array([1.0, 0, 0]) - axis[0] * axis
    first /= np.linalg.norm(first)
    area = np.linalg.norm(normals, axis=1)
    return np.array([first, np.cross(axis, first), axis]), area @ triangles.mean(axis=1) / area.sum()


@pytest.mark.parametrize("layer", [12.5e-6, 25e-6, 50e-6, 100e-6])
@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
def test_layer_of_a_bent_column_has_the_exact_mean(layer, formulation):
    """In pure bending the mean of |stress| = E kappa |x| over a layer is E kappa a / 4 for a section of side a."""
    levels = np.array([0.0, 12.5e-6, 37.5e-6, 0.1e-3, 0.2e-3, 0.26e-3, HEIGHT])
    body, watch, step = watched(column(False, False, 4, levels), ZERO, formulation=formulation, layer=layer)
    motion, (x, _, z) = motion_of(body, step), body.local.points.T
    curvature = 0.5
    motion.displacement[:] = curvature * np.stack([-(z**2) / 2, np.zeros_like(x), x * z], axis=1)
    motion.update_force()
    row = row_of(watch, motion)
    exact = ZERO.young_modulus * curvature * SIDE / 4
    for end in ("board", "package"):
        assert row[f"von_mises_{end}"][0] == pytest.approx(exact, rel=1e-9)


def test_a_layer_that_crosses_elements_takes_the_fractions_of_their_volumes():
    """Strain grows with height in elements of constant stress; the layer covers 12.5 of 50 um of the second one."""
    levels = np.array([0.0, 12.5e-6, 62.5e-6, 0.2e-3, HEIGHT])
    body, watch, step = watched(column(False, False, 2, levels), ZERO)
    motion, z = motion_of(body, step), body.local.points[:, 2]
    motion.displacement[:, 2] = 0.5 * z**2
    motion.update_force()
    means = ZERO.young_modulus * 0.5 * (levels[1:] + levels[:-1])
    row = row_of(watch, motion)
    assert row["von_mises_board"][0] == pytest.approx(0.5 * (means[0] + means[1]))
    assert row["von_mises_package"][0] == pytest.approx(means[-1])


def test_layer_average_uses_points_within_the_layer():
    """The outer points of a bent column yield first; the layer average uses only the points in the layer."""
    body, watch, step = watched(column(False, False, 2), SAC405, ForceOptions("small", 1.0))
    motion, (x, _, z) = motion_of(body, step), body.local.points.T
    for curvature in np.linspace(0.0, 12.0, 101)[1:]:
        motion.displacement[:] = curvature * np.stack([-(z**2) / 2, np.zeros_like(x), x * z], axis=1)
        motion.update_force()
    (term,) = (item for item in body.terms if isinstance(item, NonlinearElements))
    located = term.points(*term.located(np.arange(len(body.elements.cells))))
    assert located.plastic_strain.min() == 0.0 < located.plastic_strain.max()
    row = row_of(watch, motion)
    lowest = body.local.points[body.elements.cells][:, :, 2].max(axis=1) < HEIGHT / 4 + 1e-9
    below = [0, 1, 2, 3]  # points of the lower octants: the layer is thinner than half an element
    assert row["plastic_strain_board"][0] == pytest.approx(located.plastic_strain[lowest][:, below].mean())
    mises = von_mises(located.stress[lowest][:, below].reshape(-1, 6))
    assert row["von_mises_board"][0] == pytest.approx(mises.mean())


@pytest.mark.parametrize("formulation", ["incompatible_modes", "one_point"])
@pytest.mark.parametrize("bulge", [0.0, 0.2])
def test_rotated_hexahedra_have_finite_strain_stresses(formulation, bulge):
    """A column rotated by 60 degrees and stretched by 1e-4 has the von Mises stress E times 1e-4 at both pads."""
    mesh = column(False, False, bulge=bulge)
    body, watch, step = watched(mesh, ZERO, ForceOptions("corotational"), formulation)
    motion, points, angle = motion_of(body, step), body.local.points, np.pi / 3
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    motion.displacement[:] = (points * [1.0, 1.0, 1.0 + 1e-4]) @ turn.T - points
    motion.update_force()
    row = row_of(watch, motion)
    for end in ("board", "package"):
        assert row[f"von_mises_{end}"][0] == pytest.approx(ZERO.young_modulus * 1e-4, rel=2e-4)
