"""Numba kernels of the internal force. Both subtract K u from the force, one element or node pair at a time."""

from numba import njit

from fem.kernels_hexahedron import FINITE


@njit(cache=True, fastmath=FINITE)
def walsh_hadamard(values):
    """Return the Walsh-Hadamard transform of eight values: entry p is the sum over a of (-1)^|p AND a| values[a]."""
    a, b, c, d, e, f, g, h = values
    a, b, c, d, e, f, g, h = a + b, a - b, c + d, c - d, e + f, e - f, g + h, g - h
    a, b, c, d, e, f, g, h = a + c, b + d, a - c, b - d, e + g, f + h, e - g, f - h
    return a + e, b + f, c + g, d + h, a - e, b - f, c - g, d - h


@njit(cache=True, fastmath=FINITE)
def component(values, nodes, c):
    """Return component c at the eight nodes of an element."""
    return (
        values[nodes[0], c],
        values[nodes[1], c],
        values[nodes[2], c],
        values[nodes[3], c],
        values[nodes[4], c],
        values[nodes[5], c],
        values[nodes[6], c],
        values[nodes[7], c],
    )


@njit(cache=True, fastmath=FINITE)
def mix(block, x, y, z):
    """Return a symmetric 3 x 3 block times (x, y, z); the block is (xx, xy, xz, yy, yz, zz)."""
    return (
        block[0] * x + block[1] * y + block[2] * z,
        block[1] * x + block[3] * y + block[4] * z,
        block[2] * x + block[4] * y + block[5] * z,
    )


@njit(cache=True, fastmath=FINITE)
def add_box_force(cells, blocks, shape, displacement, force):
    """Subtract K u of boxes, K block diagonal in the Walsh-Hadamard basis (see ``force_congruent``).

    Args:
        cells: ``(ne, 8)`` int32.
        blocks: ``(ns, 8, 6)`` [N/m] per shape and parity, symmetric storage, divided by 8.
        shape: ``(ne,)`` int32, index into ``blocks``.
        displacement: ``(n, 3)`` [m].
        force: ``(n, 3)`` [N], added to.
    """
    for e in range(len(cells)):
        nodes = cells[e]
        x = walsh_hadamard(component(displacement, nodes, 0))
        y = walsh_hadamard(component(displacement, nodes, 1))
        z = walsh_hadamard(component(displacement, nodes, 2))
        block = blocks[shape[e]]
        p0 = mix(block[0], x[1], y[2], z[4])
        p1 = mix(block[1], x[0], y[3], z[5])
        p2 = mix(block[2], x[3], y[0], z[6])
        p3 = mix(block[3], x[2], y[1], z[7])
        p4 = mix(block[4], x[5], y[6], z[0])
        p5 = mix(block[5], x[4], y[7], z[1])
        p6 = mix(block[6], x[7], y[4], z[2])
        p7 = mix(block[7], x[6], y[5], z[3])
        x = walsh_hadamard((p1[0], p0[0], p3[0], p2[0], p5[0], p4[0], p7[0], p6[0]))
        y = walsh_hadamard((p2[1], p3[1], p0[1], p1[1], p6[1], p7[1], p4[1], p5[1]))
        z = walsh_hadamard((p4[2], p5[2], p6[2], p7[2], p0[2], p1[2], p2[2], p3[2]))
        for a in range(8):
            node = nodes[a]
            force[node, 0] -= x[a]
            force[node, 1] -= y[a]
            force[node, 2] -= z[a]


@njit(cache=True, fastmath=FINITE)
def add_block_force(pointer, columns, blocks, displacement, force):
    """Subtract K u, K symmetric in compressed rows of 3 x 3 blocks: upper blocks only, diagonal blocks halved.

    Half the blocks is half the memory traffic, which bounds this kernel. Each block serves row and column, which is
    safe because a rank is one thread.

    Args:
        pointer: ``(n + 1,)`` int32, first block of each row.
        columns: ``(nb,)`` int32.
        blocks: ``(nb, 3, 3)`` [N/m].
        displacement: ``(>= n, 3)`` [m].
        force: ``(>= n, 3)`` [N], added to.
    """
    for row in range(len(pointer) - 1):
        vx, vy, vz = displacement[row, 0], displacement[row, 1], displacement[row, 2]
        x = y = z = 0.0
        for k in range(pointer[row], pointer[row + 1]):
            block = blocks[k]
            node = columns[k]
            ux, uy, uz = displacement[node, 0], displacement[node, 1], displacement[node, 2]
            x += block[0, 0] * ux + block[0, 1] * uy + block[0, 2] * uz
            y += block[1, 0] * ux + block[1, 1] * uy + block[1, 2] * uz
            z += block[2, 0] * ux + block[2, 1] * uy + block[2, 2] * uz
            force[node, 0] -= block[0, 0] * vx + block[1, 0] * vy + block[2, 0] * vz
            force[node, 1] -= block[0, 1] * vx + block[1, 1] * vy + block[2, 1] * vz
            force[node, 2] -= block[0, 2] * vx + block[1, 2] * vy + block[2, 2] * vz
        force[row, 0] -= x
        force[row, 1] -= y
        force[row, 2] -= z


@njit(cache=True)
def assemble_upper_blocks(cells, stiffness, pointer, columns, blocks):
    """Add element stiffnesses ``(ne, 3k, 3k)`` into upper block rows with sorted columns; diagonal blocks halved."""
    for e in range(len(cells)):
        for a in range(cells.shape[1]):
            row = cells[e, a]
            for b in range(cells.shape[1]):
                column = cells[e, b]
                if column < row:
                    continue
                low, high = pointer[row], pointer[row + 1]
                while columns[low] != column:
                    middle = (low + high) // 2
                    low, high = (middle, high) if columns[middle] <= column else (low, middle)
                scale = 0.5 if row == column else 1.0
                for i in range(3):
                    for j in range(3):
                        blocks[low, i, j] += scale * stiffness[e, 3 * a + i, 3 * b + j]
