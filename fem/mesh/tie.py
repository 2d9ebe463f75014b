"""Ties between joints and facets of non-matching meshes: u_slave = N u_master, f_master += N^T f_slave.

N holds the bilinear shape functions of the closest facet at the slave's projection. Slaves are moved onto their facet
first (a joint's end is flat, a warped substrate is not), so that rigid rotations and moments carry over exactly.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import HEXAHEDRON
from reflowshock.fem.errors import TieError
from reflowshock.fem.mesh.mesh import MeshData

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
TOLERANCE = 0.02  # of the facet's size: distance of a slave from its facet
CANDIDATES = 9  # facets whose centres are nearest: a node and all its neighbours on a structured face
NEWTON_STEPS = 12
SINGULAR = 1e-9  # of the trace: where the sides of a trapezium meet, far outside it, no step is determined
EXACT = 1e-12


@dataclass(frozen=True, slots=True)
class Tie:
    """Rows of the interpolation matrix N.

    Attributes:
        slave: Slave nodes, shape (ns,), int32.
        master: Four master nodes of each slave, shape (ns, 4), int32.
        weight: Weights of the masters, shape (ns, 4).
    """

    slave: NDArray[np.int32]
    master: NDArray[np.int32]
    weight: NDArray[np.float64]

    @classmethod
    def none(cls) -> "Tie":
        """Return the tie of a model without joints."""
        return cls(np.empty(0, np.int32), np.empty((0, 4), np.int32), np.empty((0, 4)))

    def spread(self, values: NDArray[np.float64]) -> None:
        """Overwrite the slaves' rows of nodal values (n, 3) with N times the masters' rows."""
        from reflowshock.fem.kernels.motion import spread_to_slaves  # a plan loads no compiled kernels

        spread_to_slaves(self.slave, self.master, self.weight, values)

    def gather(self, values: NDArray[np.float64]) -> None:
        """Add N^T times the slaves' rows of nodal values (n, 3) to the masters' rows, then zero the slaves' rows."""
        from reflowshock.fem.kernels.motion import gather_from_slaves

        gather_from_slaves(self.slave, self.master, self.weight, values)

    def matrix(self, count: int) -> scipy.sparse.csr_matrix:
        """Return the matrix that maps the values of independent nodes to all nodes, shape (count, count)."""
        rest = np.setdiff1d(np.arange(count), self.slave)
        row = np.concatenate([rest, np.repeat(self.slave, self.master.shape[1])])
        column = np.concatenate([rest, self.master.ravel()])
        weight = np.concatenate([np.ones(len(rest)), self.weight.ravel()])
        return scipy.sparse.csr_matrix((weight, (row, column)), shape=(count, count))


def tie_joints(mesh: MeshData) -> tuple[MeshData, Tie, float]:
    """Tie the ends of all joints: facet sets ``foot@..`` to ``board_side``, ``head@..`` to ``package_side``.

    Likewise, non-matching layers are tied: ``slave@..`` to ``master@..`` of the same name. The displacement of a slave
    node is interpolated between the four nodes of a master facet.

    Args:
        mesh: Mesh with these facet sets; without them it is returned unchanged, with an empty tie.

    Returns:
        The mesh with its slaves moved onto their facets, the tie (slaves, their masters and weights), and the largest
        such move [m].

    Raises:
        TieError: The mesh has joints but no hexahedra, or a node has no facet within the tolerance, is tied twice, or
            is both slave and master.
    """
    if mesh.shape is not HEXAHEDRON and any("@" in name for name in mesh.facets):
        raise TieError(f"joints are tied to quadrilateral facets only: the mesh needs hexahedra, not {mesh.shape.name}")
    ends = [(name, name.replace("slave@", "master@", 1)) for name in mesh.facets if name.startswith("slave@")]
    ends += [(name, "board_side") for name in mesh.facets if name.startswith("foot@")]
    ends += [(name, "package_side") for name in mesh.facets if name.startswith("head@")]
    ties = [_tie_end(mesh, end, side) for end, side in ends if len(mesh.facets[end])]
    if not ties:
        return mesh, Tie.none(), 0.0
    tie = Tie(*(np.concatenate([getattr(item, name) for item in ties]) for name in ("slave", "master", "weight")))
    both = np.intersect1d(tie.slave, tie.master)
    if len(both) or len(np.unique(tie.slave)) < len(tie.slave):
        raise TieError(
            f"{len(both)} nodes are slave and master of ties, or a node is tied twice; each end needs its own"
        )
    points = mesh.points.copy()
    tie.spread(points)
    moved = float(np.linalg.norm(points - mesh.points, axis=1).max())
    check_tie(tie, points)
    return replace(mesh, points=points), tie, moved


def _tie_end(mesh: MeshData, end: str, side: str) -> Tie:
    """Tie the nodes of one end of a joint to the facets of a side; errors as ``tie_joints``."""
    facets = mesh.facets_of(side)
    if not len(facets):
        raise TieError(f"{end} has no facet to be tied to: the facet set {side} is empty")
    slaves = mesh.facet_nodes(end)
    facet, xi, distance = closest_facets(mesh.points[slaves], mesh.points[facets])
    size = np.linalg.norm(np.ptp(mesh.points[facets[facet]], axis=1), axis=1)
    worst = int(np.argmax(distance / size))
    if distance[worst] > TOLERANCE * size[worst]:
        position = ", ".join(f"{value:.6g}" for value in mesh.points[slaves[worst]])
        raise TieError(
            f"{end}: the node at ({position}) m is {distance[worst]:.3e} m away from {side}, allowed are"
            f" {TOLERANCE * size[worst]:.3e} m ({TOLERANCE:g} of the facet)"
        )
    return Tie(slaves.astype(np.int32), facets[facet].astype(np.int32), bilinear(xi))


def bilinear(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shape functions of quadrilaterals at reference points, shape (m, 4), nodes in cyclic order.

    Args:
        xi: Reference points from -1 to 1, shape (m, 2).
    """
    return 0.25 * np.prod(1.0 + xi[:, None, :] * CORNERS, axis=2)


def _bilinear_derivatives(xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivatives of the shape functions of a quadrilateral at xi (m, 2), shape (m, 4, 2)."""
    return 0.25 * CORNERS * (1.0 + xi[:, None, ::-1] * CORNERS[:, ::-1])


def closest_facets(
    points: NDArray[np.float64], corners: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Find the quadrilateral that is closest to each point.

    Args:
        points: Points, shape (m, 3) [m].
        corners: Corners of the quadrilaterals in cyclic order, shape (nf, 4, 3) [m].

    Returns:
        Facet of each point, shape (m,); reference coordinates of its closest point, from -1 to 1, shape (m, 2); and
        distance, shape (m,) [m].
    """
    from scipy.spatial import cKDTree  # imported late to keep the start-up of plans fast

    count = min(CANDIDATES, len(corners))
    _, near = cKDTree(corners.mean(axis=1)).query(points, k=count)
    near = near.reshape(len(points), count)
    xi, distance = project(np.repeat(points, count, axis=0), corners[near.ravel()])
    distance = distance.reshape(len(points), count)
    best = np.argmin(distance, axis=1)
    chosen = np.arange(len(points)), best
    return near[chosen], xi.reshape(len(points), count, 2)[chosen], distance[chosen]


def project(
    points: NDArray[np.float64], corners: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Project each point onto its own quadrilateral by Gauss-Newton iterations, clipped to the inside.

    Args:
        points: Points, shape (m, 3) [m].
        corners: Corners of the quadrilateral of each point in cyclic order, shape (m, 4, 3) [m].

    Returns:
        Reference coordinates from -1 to 1, shape (m, 2), and distances, shape (m,) [m].
    """
    xi = np.zeros((len(points), 2))
    for _ in range(NEWTON_STEPS):
        residual = points - np.einsum("ma,mai->mi", bilinear(xi), corners)
        tangent = np.einsum("mad,mai->mid", _bilinear_derivatives(xi), corners)
        normal = np.einsum("mid,mie->mde", tangent, tangent)
        normal += SINGULAR * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        step = np.linalg.solve(normal, np.einsum("mid,mi->md", tangent, residual)[:, :, None])[:, :, 0]
        xi = np.clip(xi + step, -3.0, 3.0)  # distant candidates only need finite values
    xi = np.clip(xi, -1.0, 1.0)
    return xi, np.linalg.norm(points - np.einsum("ma,mai->mi", bilinear(xi), corners), axis=1)


def check_tie(tie: Tie, points: NDArray[np.float64]) -> None:
    """Check a tie on its points: partition of unity, linear fields, net force and moment of unit forces.

    Args:
        tie: Slaves, masters and weights.
        points: Nodes of the mesh, with the slaves on their facets, shape (n, 3) [m].

    Raises:
        TieError: One of them is not exact to 1e-12.
    """
    unity = float(np.abs(tie.weight.sum(axis=1) - 1.0).max())
    size = float(np.ptp(points, axis=0).max())
    linear = points @ np.array([[0.3, -1.0, 0.5], [1.0, 0.2, -0.7], [-0.4, 0.6, 1.0]])
    interpolated = linear.copy()
    tie.spread(interpolated)
    field = float(np.abs(interpolated - linear).max()) / size
    force = np.zeros_like(points)
    force[tie.slave] = np.sin(np.arange(3 * len(tie.slave))).reshape(-1, 3)
    before = net_load(points, force)
    tie.gather(force)
    scale = np.array([1.0] * 3 + [size] * 3) * len(tie.slave)
    load = float(np.abs((net_load(points, force) - before) / scale).max())
    if max(unity, field, load) > EXACT:
        raise TieError(
            f"tie of {len(tie.slave)} nodes is not exact to {EXACT:g}: partition of unity {unity:.2e}, linear field"
            f" {field:.2e}, net force and moment {load:.2e}"
        )


def net_load(points: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the net force [N] and net moment about the origin [N m] of point forces, shape (6,), force first.

    Args:
        points: Points of action, shape (n, 3) [m].
        force: Force at each point, shape (n, 3) [N].
    """
    return np.concatenate([force.sum(axis=0), np.cross(points, force).sum(axis=0)])
