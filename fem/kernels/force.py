"""Numba kernels of the internal force from an assembled matrix of 3 x 3 blocks."""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE


@njit(cache=True, fastmath=FINITE)
def add_block_force(pointer, columns, blocks, displacement, force):
    """Subtract K u from the force, K a symmetric matrix in compressed rows of 3 x 3 blocks.

    Only the upper blocks are stored, diagonal blocks halved. Half the blocks is half the memory traffic, which bounds
    this kernel. Each block serves row and column, which is safe because a rank is one thread. Unsigned indices spare
    the test for negative ones at each access.

    Args:
        pointer: Index of the first block of each row, then the number of blocks, shape (n + 1,) int32.
        columns: Column (node) of each block, shape (nb,) int32.
        blocks: Upper blocks of K, diagonal ones halved, shape (nb, 3, 3) [N/m].
        displacement: Nodal displacement u, shape (>= n, 3) [m].
        force: Nodal force, shape (>= n, 3) [N], subtracted from.
    """
    for row in range(len(pointer) - 1):
        if pointer[row] == pointer[row + 1]:  # most nodes, where few elements of a model are assembled
            continue
        vx, vy, vz = displacement[row, 0], displacement[row, 1], displacement[row, 2]
        x = y = z = 0.0
        for k in range(np.uintp(pointer[row]), np.uintp(pointer[row + 1])):
            node = np.uintp(columns[k])
            xx, xy, xz = blocks[k, 0, 0], blocks[k, 0, 1], blocks[k, 0, 2]  # all read before the force is written,
            yx, yy, yz = blocks[k, 1, 0], blocks[k, 1, 1], blocks[k, 1, 2]  # which might overlap for all the compiler
            zx, zy, zz = blocks[k, 2, 0], blocks[k, 2, 1], blocks[k, 2, 2]  # knows
            ux, uy, uz = displacement[node, 0], displacement[node, 1], displacement[node, 2]
            fx, fy, fz = force[node, 0], force[node, 1], force[node, 2]
            x += xx * ux + xy * uy + xz * uz
            y += yx * ux + yy * uy + yz * uz
            z += zx * ux + zy * uy + zz * uz
            force[node, 0] = fx - (xx * vx + yx * vy + zx * vz)
            force[node, 1] = fy - (xy * vx + yy * vy + zy * vz)
            force[node, 2] = fz - (xz * vx + yz * vy + zz * vz)
        force[row, 0] -= x
        force[row, 1] -= y
        force[row, 2] -= z


@njit(cache=True)
def assemble_upper_blocks(cells, stiffness, pointer, columns, blocks):
    """Add element stiffnesses to the upper 3 x 3 blocks of a symmetric matrix in compressed rows.

    Diagonal blocks are halved, as ``add_block_force`` expects.

    Args:
        cells: Nodes of each element of k nodes, shape (ne, k).
        stiffness: Element stiffnesses, node by node, shape (ne, 3k, 3k) [N/m].
        pointer: First block of each row, and the number of blocks, shape (n + 1,).
        columns: Column (node) of each block, ascending in a row, shape (nb,); must contain all pairs of ``cells``.
        blocks: Blocks of the matrix, shape (nb, 3, 3) [N/m], added to.
    """
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
