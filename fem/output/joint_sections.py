"""Section forces of joints: what board and package pull at the solder with, from the forces of its elements.

At the nodes of a pad's face the solder gets F_n = f_n + m_n (a_n - g + alpha v_n): f the internal forces of its own
elements (with those of stiffness-proportional damping), m their mass. The sum over both faces is exactly what all its
mass needs, sum of m (a - g + alpha v), for force and moment: inner nodes obey the equation of motion. Where elements
turn, places, area and normal are the present ones.
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
    """Nodes with a mass, each belonging to a slot: ``(k,)`` local numbers, slots, masses [kg]."""

    nodes: NDArray[np.int64]
    slot: NDArray[np.int64]
    mass: NDArray[np.float64]

    @classmethod
    def of(cls, body: Body, cells: NDArray[np.integer], slot: NDArray[np.int64]) -> "Mass":
        """Take the lumped mass of elements ``cells (k,)``, each in a slot ``(k,)``."""
        mass = body.elements.density[cells, None] * body.geometry.nodal_volume[cells]
        keys = np.stack([np.repeat(slot, mass.shape[1]), body.elements.cells[cells].ravel()])
        unique, index = np.unique(keys, axis=1, return_inverse=True)
        return cls(unique[1], unique[0], np.bincount(index.reshape(-1), mass.ravel(), len(unique[0])).astype(float))


class JointSections:
    """The sections of all joints as far as one rank has them.

    A slot is end times joints plus joint; signs are those of a beam from board to package: tension is positive.
    """

    def __init__(self, tables: JointTables, body: Body, elements: JointElements, damping: tuple[float, float]) -> None:
        """Take the rank's share of the tables; ``elements`` tell all forces at the pads, ``damping`` is alpha, beta."""
        faces, watch, local = tables.watch.faces, tables.watch, body.local
        self._faces, self._elements, self._tie, self._points = faces, elements, body.tie, local.points
        self._alpha, self._beta = damping
        self._joints = len(watch.joints)
        self._finite = body.turns
        nodes, bearing = local.locate(faces.nodes), local.locate_cells(faces.cells)
        slot = np.full(len(local.points), -1)
        slot[nodes[nodes >= 0]] = faces.node_slot[nodes >= 0]
        near = Mass.of(body, bearing[bearing >= 0], np.zeros_like(bearing[bearing >= 0], np.int64))
        here = slot[near.nodes] >= 0
        self._held = Mass(near.nodes[here], slot[near.nodes[here]], near.mass[here])
        solder = local.locate_cells(watch.solder_cells)
        self._solder = Mass.of(body, solder[solder >= 0], watch.solder_joint[solder >= 0])
        loose = body.free.all(axis=1)
        loose[body.tie.slave] = True
        self._supported = np.bincount(self._solder.slot, ~loose[self._solder.nodes], self._joints)
        self._middle = faces.centre.reshape(2, -1, 3).mean(axis=0)
        owner = local.locate_cells(faces.facet_cell) >= 0
        self._facets = local.locate(faces.facets[owner].ravel()).reshape(-1, 4)
        self._facet_slot, self._facet_sign = faces.facet_slot[owner], faces.facet_sign[owner]

    def sums(self, motion: Motion) -> NDArray[np.float64]:
        """Return this rank's parts; collective where a body has levels.

        Returns:
            ``(2 joints * 13 + joints * 7,)``: per slot force [N], moment about the undeformed centre [N m], area times
            centroid [m^3], area vector, area [m^2]; per joint the force and moment about its middle that its mass
            needs, and how many of its nodes a support holds.
        """
        velocity = motion.velocity.copy() if self._beta else None
        if velocity is not None:
            self._tie.spread(velocity)
            velocity *= self._beta
        pull = self._elements.forces(motion.displacement, velocity)
        needed = motion.acceleration() - motion.gravity
        if self._alpha:
            needed += self._alpha * motion.present_velocity()
        self._tie.spread(needed)
        places = self._points + motion.displacement if self._finite else self._points
        given = -pull[self._held.nodes] + self._held.mass[:, None] * needed[self._held.nodes]
        sections = loads(places, self._held, given, self._faces.centre)
        inertia = loads(places, self._solder, self._solder.mass[:, None] * needed[self._solder.nodes], self._middle)
        corners = places[self._facets]
        normal, first, area = facet_sums(corners)
        values = np.column_stack([first, self._facet_sign[:, None] * normal, area])
        shape = summed(self._facet_slot, values, len(self._faces.centre))
        return np.concatenate([sections, shape, inertia, self._supported[:, None]], axis=None)


def loads(
    places: NDArray[np.float64], mass: Mass, force: NDArray[np.float64], about: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return force and moment ``(slots, 6)`` of forces at nodes ``(k, 3)`` [N] about a point of each slot."""
    arm = places[mass.nodes] - about[mass.slot]
    return summed(mass.slot, np.column_stack([force, np.cross(arm, force)]), len(about))


def summed(slot: NDArray[np.int64], values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the sums ``(count, c)`` of rows ``(k, c)`` by slot."""
    return np.stack([np.bincount(slot, column, count) for column in values.T], axis=1)


def section_values(sums: NDArray[np.float64], faces: PadFaces) -> dict[str, NDArray[np.float64]]:
    """Return the histories' values of a sample from the sums of ``JointSections`` over all ranks.

    Returns:
        At ``board`` and ``package``: ``section_<end> (joints, 6)`` axial force, two shears [N], torsion, two bending
        moments [N m] about the pad's centre; ``peel_<end> (joints,)`` axial force over area, ``outer_fibre_<end>``
        that plus bending over section modulus [Pa]; and ``section_imbalance (joints,)`` [N], what both sections miss
        of the joint's inertia (moments over the distance of the pads).
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
    turned = [sign * np.einsum("sij,sj->si", frame, item) for item in (force, moment - np.cross(moved, force))]
    resultants = np.concatenate(turned, axis=1)
    peel = resultants[:, 0] / area
    fibre = peel + np.hypot(resultants[:, 4], resultants[:, 5]) / faces.modulus
    ends = {
        f"{name}_{end}": values
        for name, both in (("section", resultants), ("peel", peel), ("outer_fibre", fibre))
        for end, values in zip(ENDS, np.split(both, 2), strict=True)
    }
    return ends | {"section_imbalance": np.where(supported > 0.0, 0.0, imbalance(load, inertia, faces.centre))}


def imbalance(
    load: NDArray[np.float64], inertia: NDArray[np.float64], centre: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what forces and moments ``(2 joints, 6)`` of both faces miss of those that the joints' mass needs [N]."""
    ends = centre.reshape(2, -1, 3)
    arm = (ends - ends.mean(axis=0)).reshape(-1, 3)
    about_middle = load + np.concatenate([np.zeros_like(arm), np.cross(arm, load[:, :3])], axis=1)
    missing = about_middle.reshape(2, -1, 6).sum(axis=0) - inertia
    height = np.linalg.norm(ends[1] - ends[0], axis=1)
    return np.asarray(
        np.maximum(np.linalg.norm(missing[:, :3], axis=1), np.linalg.norm(missing[:, 3:], axis=1) / height)
    )
