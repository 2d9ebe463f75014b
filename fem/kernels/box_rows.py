"""Numba kernels of the internal force of rows of equal boxes, vectorised along the row; see ``force_congruent``.

A row is a run of boxes between four lines of nodes. Lines are stored component by component, so that the lanes of a
vector are consecutive nodes of a line. With k the parity across the row (bit 0: second direction, bit 1: third), the
Walsh-Hadamard transform over the four lines gives face values t_k at each node, and the boxes of a row couple only
neighbours: with s = t_left + t_right, d = t_left - t_right and t itself, even and odd blocks E and O of parity k along
the row give, at an inner node (components 0, 1, 2 have face parity k, k XOR 1, k XOR 2),

    f_0 = (O_00 - E_00) s_0 + 2 (O_00 + E_00) t_0 + (O_01 - E_01) d_1 + (O_02 - E_02) d_2
    f_i = sum over j = 1, 2 of (E_ij - O_ij) s_j + 2 (E_ij + O_ij) t_j  -  (O_0i - E_0i) d_0

The two ends have one box only. The parts of the kernel are inlined before compilation: views of arrays passed to a
compiled function would be counted as references at each call.
"""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE

LONGEST = 128  # boxes of a row: what a row works with stays in the fastest cache
LANES = 8  # of a vector; loops run over whole vectors, and past the end of a line
PAD = 2 * LANES  # positions that may be read after the last line
FIRST = LANES - 1  # column of lane 0: lane 1, where inner nodes begin, is aligned
COLUMNS = LONGEST + 3 * LANES


@njit(cache=True)
def read_lines(nodes, axes, values, lines):
    """Copy nodal vectors into lines of nodes, component by component.

    Args:
        nodes: Node at each position of the lines, shape (p,).
        axes: Coordinate directions 0 to 2 in the order of the frame of the rows, shape (3,).
        values: Nodal vectors, such as displacements [m], shape (n, 3).
        lines: Written: component c of position i at ``lines[c, i]`` is ``values[nodes[i], axes[c]]``, shape (3, >= p).
    """
    x, y, z = axes[0], axes[1], axes[2]
    for p in range(len(nodes)):
        node = nodes[p]
        lines[0, p] = values[node, x]
        lines[1, p] = values[node, y]
        lines[2, p] = values[node, z]


@njit(cache=True)
def subtract_lines(nodes, axes, lines, values):
    """Subtract lines of nodes from nodal vectors, and zero the lines; the reverse of ``read_lines``.

    Args:
        nodes: Node at each position of the lines, shape (p,).
        axes: Coordinate directions 0 to 2 in the order of the frame of the rows, shape (3,).
        lines: Values at the positions, such as forces [N], shape (3, >= p), zeroed.
        values: Nodal vectors, shape (n, 3), subtracted from.
    """
    x, y, z = axes[0], axes[1], axes[2]
    for p in range(len(nodes)):
        node = nodes[p]
        values[node, x] -= lines[0, p]
        values[node, y] -= lines[1, p]
        values[node, z] -= lines[2, p]
        lines[0, p] = lines[1, p] = lines[2, p] = 0.0


@njit(inline="always")
def transform_lines(line, starts, count, faces):
    """Compute sums and differences of one component over the four lines of a row (Walsh-Hadamard transform).

    Args:
        line: Component, such as the displacement along x [m], at all positions of the lines, shape (>= p,).
        starts: Positions at which the four lines of the row begin, second direction first, shape (4,).
        count: Number of nodes along the row, integer.
        faces: Written: ``faces[k, FIRST + i]`` is the sum over the four nodes i of the lines, with signs that change
            along the second direction if bit 0 of k is set, along the third if bit 1 is; shape (4, >= FIRST + count).
    """
    a, b = line[starts[0] : starts[0] + count], line[starts[1] : starts[1] + count]
    c, d = line[starts[2] : starts[2] + count], line[starts[3] : starts[3] + count]
    t0, t1, t2, t3 = faces[0, FIRST:], faces[1, FIRST:], faces[2, FIRST:], faces[3, FIRST:]
    for i in range(count):
        p, q, r, s = a[i] + b[i], a[i] - b[i], c[i] + d[i], c[i] - d[i]
        t0[i], t1[i], t2[i], t3[i] = p + r, q + s, p - r, q - s


@njit(inline="always")
def add_transform(faces, starts, count, line):
    """Add face values, transformed back to the nodes, to one component of the four lines of a row.

    This is the transpose of ``transform_lines``: forces on sums and differences become forces on the nodes.

    Args:
        faces: Value of parity k at node i at ``faces[k, FIRST + i]``, such as a force [N]; it acts on the four nodes
            with signs that change along the second direction if bit 0 of k is set, along the third if bit 1 is; shape
            (4, >= FIRST + count).
        starts: Positions at which the four lines of the row begin, second direction first, shape (4,).
        count: Number of nodes along the row, integer.
        line: Component at all positions of the lines, shape (>= p,), added to.
    """
    a, b = line[starts[0] : starts[0] + count], line[starts[1] : starts[1] + count]
    c, d = line[starts[2] : starts[2] + count], line[starts[3] : starts[3] + count]
    t0, t1, t2, t3 = faces[0, FIRST:], faces[1, FIRST:], faces[2, FIRST:], faces[3, FIRST:]
    for i in range(count):
        p, q, r, s = t0[i] + t1[i], t0[i] - t1[i], t2[i] + t3[i], t2[i] - t3[i]
        a[i] += p + r
        b[i] += q + s
        c[i] += p - r
        d[i] += q - s


@njit(inline="always")
def couple_inner(pair, k, count, faces, forces):
    """Write the face forces of one parity at the inner nodes of a row of equal boxes, from their stiffness blocks.

    Face values are sums and differences over the four lines of the row, see ``transform_lines``. Component 0 is taken
    at parity k, component 1 at k XOR 1, component 2 at k XOR 2.

    Args:
        pair: Even and odd block E and O of the parity along the row, symmetric 3 x 3 matrices with entries 00 01 02 11
            12 22, shape (2, 6) [N/m].
        k: Parity across the row, integer 0 to 3.
        count: Number of boxes in the row, integer.
        faces: Face values of the displacement, component by parity by node (first node at column ``FIRST``), shape (3,
            4, COLUMNS) [m].
        forces: Face values of the force in the same order, shape (3, 4, COLUMNS) [N]; nodes 1 to ``count - 1`` are
            written, up to whole vectors.
    """
    e, o = pair[0], pair[1]
    x, y, z = faces[0, k, FIRST:], faces[1, k ^ 1, FIRST:], faces[2, k ^ 2, FIRST:]
    fx, fy, fz = forces[0, k, LANES:], forces[1, k ^ 1, LANES:], forces[2, k ^ 2, LANES:]
    xx, xy, xz, yy, yz, zz = o[0] - e[0], o[1] - e[1], o[2] - e[2], e[3] - o[3], e[4] - o[4], e[5] - o[5]
    own_x, own_y, own_yz, own_z = 2 * (o[0] + e[0]), 2 * (e[3] + o[3]), 2 * (e[4] + o[4]), 2 * (e[5] + o[5])
    for i in range((count - 2 + LANES) // LANES * LANES):
        sx, dx, tx = x[i] + x[i + 2], x[i] - x[i + 2], x[i + 1]
        sy, dy, ty = y[i] + y[i + 2], y[i] - y[i + 2], y[i + 1]
        sz, dz, tz = z[i] + z[i + 2], z[i] - z[i + 2], z[i + 1]
        fx[i] = xx * sx + own_x * tx + xy * dy + xz * dz
        fy[i] = yy * sy + own_y * ty + yz * sz + own_yz * tz - xy * dx
        fz[i] = yz * sy + own_yz * ty + zz * sz + own_z * tz - xz * dx


@njit(inline="always")
def couple_ends(pair, k, count, faces, forces):
    """Write the face forces of one parity at the first and last node of a row, which belong to one box only.

    Face values are sums and differences over the four lines of the row, see ``transform_lines``.

    Args:
        pair: Even and odd block E and O of the parity along the row, symmetric 3 x 3 matrices with entries 00 01 02 11
            12 22, shape (2, 6) [N/m].
        k: Parity across the row, integer 0 to 3.
        count: Number of boxes in the row, integer.
        faces: Face values of the displacement, component by parity by node (first node at column ``FIRST``), shape (3,
            4, COLUMNS) [m].
        forces: Face values of the force in the same order, shape (3, 4, COLUMNS) [N]; nodes 0 and ``count`` are
            written.
    """
    e, o = pair[0], pair[1]
    x, y, z = faces[0, k], faces[1, k ^ 1], faces[2, k ^ 2]
    for end in range(2):
        left = FIRST + end * (count - 1)
        node, sign = FIRST + end * count, 1.0 - 2.0 * end
        sx, sy, sz = x[left] + x[left + 1], y[left] + y[left + 1], z[left] + z[left + 1]
        dx, dy, dz = x[left] - x[left + 1], y[left] - y[left + 1], z[left] - z[left + 1]
        forces[0, k, node] = o[0] * sx + o[1] * dy + o[2] * dz + sign * (e[0] * dx + e[1] * sy + e[2] * sz)
        forces[1, k ^ 1, node] = e[1] * dx + e[3] * sy + e[4] * sz + sign * (o[1] * sx + o[3] * dy + o[4] * dz)
        forces[2, k ^ 2, node] = e[2] * dx + e[4] * sy + e[5] * sz + sign * (o[2] * sx + o[4] * dy + o[5] * dz)


@njit(cache=True, fastmath=FINITE)
def add_row_forces(rows, blocks, displacement, force):
    """Add the internal force K u of rows of equal linear elastic boxes; the caller subtracts it from the nodal force.

    Args:
        rows: One row per row of boxes, shape (nr, 6) int32: positions at which its four lines of nodes begin (second
            direction first), number of boxes (at most ``LONGEST``), index into ``blocks``.
        blocks: Stiffness of each shape and parity (bit d: odd along direction d), entries 00 01 02 11 12 22 divided by
            8, shape (ns, 8, 6) [N/m].
        displacement: Displacement u, component by position in the lines, shape (3, >= p + PAD) [m]; finite in the
            padding.
        force: K u, component by position in the lines, shape (3, >= p + PAD) [N], added to.
    """
    faces, forces = np.zeros((3, 4, COLUMNS)), np.zeros((3, 4, COLUMNS))
    for r in range(len(rows)):
        starts, count = rows[r, :4], rows[r, 4]
        block = blocks[rows[r, 5]]
        for c in range(3):
            transform_lines(displacement[c], starts, (count + LANES) // LANES * LANES, faces[c])
        for k in range(4):
            couple_inner(block[2 * k : 2 * k + 2], k, count, faces, forces)
            couple_ends(block[2 * k : 2 * k + 2], k, count, faces, forces)
        for c in range(3):
            add_transform(forces[c], starts, count + 1, force[c])
