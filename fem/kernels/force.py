"""Numba kernels of the internal force from an assembled matrix of 3 x 3 blocks."""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE


@njit(cache=True, fastmath=FINITE)
def add_block_force(pointer, columns, blocks, displacement, force):
    """Subtract K u, K symmetric in compressed rows of 3 x 3 blocks: upper blocks only, diagonal blocks halved.

    Half the blocks is half the memory traffic, which bounds this kernel. Each block serves row and column, which is
    safe because a rank is one thread. Unsigned indices spare the test for negative ones at each access.

    Args:
        pointer: ``(n + 1,)`` int32, first block of each row.
        columns: ``(nb,)`` int32.
        blocks: ``(nb, 3, 3)`` [N/m].
        displacement: ``(>= n, 3)`` [m].
        force: ``(>= n, 3)`` [N], added to.
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
