"""Section forces of joints at board and package, from the nodal forces of the solder elements.

The solder receives F_n = f_n + m_n (a_n - g + alpha v_n) at the nodes of a pad face, where f is the internal force of
its elements (stiffness-proportional damping included), m their mass and v the velocity relative to the table. Since
inner nodes obey the equation of motion, the forces and moments of both faces add up exactly to the inertia of the
solder, sum of m (a - g + alpha v). With finite rotations, positions, areas and normals refer to the deformed state.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.tables import JointTables
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.mesh.pad_faces import ENDS, PadFaces, facet_sums, section_frame
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.joint_elements import JointElements

RESULTANTS = ("axial force", "shear x", "shear y", "torsion", "bending x", "bending y")


@dataclass(frozen=True, slots=True)
class Mass:
    """Nodal masses by slot: local node numbers, slots and masses [kg], each of shape (k,)."""

    nodes: NDArray[np.int64]
    slot: NDArray[np.int64]
    mass: NDArray[np.float64]

    @classmethod
    def of(cls, body: Body, cells: NDArray[np.integer], slot: NDArray[np.int64]) -> "Mass":
        """Return the lumped mass of elements, shape (k,), each of which belongs to a slot, shape (k,)."""
        mass = body.elements.density[cells, None] * body.geometry.nodal_volume[cells]
        keys = np.stack([np.repeat(slot, mass.shape[1]), body.elements.cells[cells].ravel()])
        unique, index = np.unique(keys, axis=1, return_inverse=True)
        return cls(unique[1], unique[0], np.bincount(index.reshape(-1), mass.ravel(), len(unique[0])).astype(float))


class JointSections:
    """Contributions of one rank to the section forces of all joints.

    A slot is end times number of joints plus joint. Signs are those of a beam from board to package, so tension is
    positive.
    """

    def __init__(self, tables: JointTables, body: Body, elements: JointElements, alpha: float, beta: float) -> None:
        """Select the rank's share of the tables.

        Args:
            tables: Tables of the model.
            body: Model on this rank.
            elements: Elements at the pads with their nodal forces.
            alpha: Mass-proportional damping [1/s].
            beta: Stiffness-proportional damping [s].
        """
        faces, watch, local = tables.watch.faces, tables.watch, body.local
        self._faces, self._elements, self._tie, self._points = faces, elements, body.tie, local.points
        self._alpha, self._beta = alpha, beta
        self._joints = len(watch.joints)
        self._finite = body.turns
        nodes, bearing = local.locate(faces.nodes), local.locate_cells(faces.cells)
        slot = np.full(len(local.points), -1)
        slot[nodes[nodes >= 0]] = faces.node_slot[nodes >= 0]
        near = Mass.of(body, bearing[bearing >= 0], np.zeros_like(bearing[bearing >= 0], np.int64))
        on_pad = slot[near.nodes] >= 0
        self._pad_mass = Mass(near.nodes[on_pad], slot[near.nodes[on_pad]], near.mass[on_pad])
        solder = local.locate_cells(watch.solder_cells)
        self._solder = Mass.of(body, solder[solder >= 0], watch.solder_joint[solder >= 0])
        is_free = body.free.all(axis=1)
        is_free[body.tie.slave] = True
        self._supported = np.bincount(self._solder.slot, ~is_free[self._solder.nodes], self._joints)
        self._middle = faces.centre.reshape(2, -1, 3).mean(axis=0)
        owner = local.locate_cells(faces.facet_cell) >= 0
        self._facets = local.locate(faces.facets[owner].ravel()).reshape(-1, 4)
        self._facet_slot, self._facet_sign = faces.facet_slot[owner], faces.facet_sign[owner]

    def sums(self, motion: Motion) -> NDArray[np.float64]:
        """Return this rank's contributions; collective if the body has local time steps.

        Returns:
            Array of shape (2 joints * 13 + joints * 7,). For each slot: force [N], moment about the undeformed centre
            [N m], area times centroid [m^3], area vector and area [m^2]. For each joint: inertia force and moment about
            its middle, and the number of supported nodes.
        """
        velocity = motion.velocity.copy() if self._beta else None
        if velocity is not None:
            self._tie.spread(velocity)
            velocity *= self._beta
        internal = self._elements.forces(motion.displacement, velocity)
        inertial = motion.acceleration() - motion.gravity
        if self._alpha:
            inertial += self._alpha * (motion.present_velocity() - motion.base_velocity())
        self._tie.spread(inertial)
        points = self._points + motion.displacement if self._finite else self._points
        pad_mass, solder = self._pad_mass, self._solder
        pad_forces = -internal[pad_mass.nodes] + pad_mass.mass[:, None] * inertial[pad_mass.nodes]
        sections = _loads(points, pad_mass, pad_forces, self._faces.centre)
        inertia = _loads(points, solder, solder.mass[:, None] * inertial[solder.nodes], self._middle)
        corners = points[self._facets]
        normal, first, area = facet_sums(corners)
        values = np.column_stack([first, self._facet_sign[:, None] * normal, area])
        shape = _sum_by_slot(self._facet_slot, values, len(self._faces.centre))
        return np.concatenate([sections, shape, inertia, self._supported[:, None]], axis=None)


def _loads(
    points: NDArray[np.float64], mass: Mass, force: NDArray[np.float64], about: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return force and moment about a point of each slot, shape (slots, 6), of nodal forces, shape (k, 3) [N]."""
    arm = points[mass.nodes] - about[mass.slot]
    return _sum_by_slot(mass.slot, np.column_stack([force, np.cross(arm, force)]), len(about))


def _sum_by_slot(slot: NDArray[np.int64], values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the sums by slot, shape (count, c), of rows of values, shape (k, c)."""
    return np.stack([np.bincount(slot, column, count) for column in values.T], axis=1)


def section_values(sums: NDArray[np.float64], faces: PadFaces) -> dict[str, NDArray[np.float64]]:
    """Compute section forces, moments and stresses of all joints in a sample from the sums of ``JointSections``.

    Args:
        sums: Result of ``JointSections.sums``, added over all ranks, shape (33 joints,): forces and moments on the pad
            faces [N, N m], shapes of the deformed faces, and inertia of the joints.
        faces: Pad faces of all joints: centroids, frames, areas and section moduli at rest.

    Returns:
        For the ends ``board`` and ``package``: ``section_<end>``, axial force, two shear forces [N], torsion and two
        bending moments about the pad centre [N m], shape (joints, 6); ``peel_<end>``, axial force over area, shape
        (joints,) [Pa]; ``outer_fibre_<end>``, peel plus bending stress, shape (joints,) [Pa]. In addition
        ``section_imbalance``, the difference between both sections and the joint's inertia (moments divided by the
        distance of the pads), shape (joints,) [N].
    """
    slots = len(faces.centre)
    joints = slots // 2
    load, shape = np.split(sums[: slots * 12 + slots].reshape(-1), [slots * 6])
    load, shape = load.reshape(slots, 6), shape.reshape(slots, 7)
    inertia = sums[slots * 13 :][: joints * 6].reshape(joints, 6)
    supported = sums[slots * 13 + joints * 6 :]
    force, moment, area = load[:, :3], load[:, 3:], shape[:, 6]
    moved = shape[:, :3] / area[:, None] - faces.centre
    sign = np.repeat([-1.0, 1.0], joints)[:, None]
    frame = section_frame(shape[:, 3:6])[:, [2, 0, 1]]
    rotated = [sign * np.einsum("sij,sj->si", frame, item) for item in (force, moment - np.cross(moved, force))]
    resultants = np.concatenate(rotated, axis=1)
    peel = resultants[:, 0] / area
    fibre = peel + np.hypot(resultants[:, 4], resultants[:, 5]) / faces.modulus
    ends = {
        f"{name}_{end}": values
        for name, both in (("section", resultants), ("peel", peel), ("outer_fibre", fibre))
        for end, values in zip(ENDS, np.split(both, 2), strict=True)
    }
    return ends | {"section_imbalance": np.where(supported > 0.0, 0.0, _imbalance(load, inertia, faces.centre))}


def _imbalance(
    load: NDArray[np.float64], inertia: NDArray[np.float64], centre: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the difference between the loads of both faces, shape (2 joints, 6), and the joints' inertia [N]."""
    ends = centre.reshape(2, -1, 3)
    arm = (ends - ends.mean(axis=0)).reshape(-1, 3)
    about_middle = load + np.concatenate([np.zeros_like(arm), np.cross(arm, load[:, :3])], axis=1)
    difference = about_middle.reshape(2, -1, 6).sum(axis=0) - inertia
    height = np.linalg.norm(ends[1] - ends[0], axis=1)
    return np.asarray(
        np.maximum(np.linalg.norm(difference[:, :3], axis=1), np.linalg.norm(difference[:, 3:], axis=1) / height)
    )
