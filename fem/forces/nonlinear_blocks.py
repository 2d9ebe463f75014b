"""Elements in blocks of lanes for the nonlinear kernels: order, constants of shapes, initial state.

A lane is the place of one element in a block. Blocks have sixteen lanes, those of one-point hexahedra ``WIDTH``.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements, element_geometry
from reflowshock.fem.elements.one_point import hourglass_control
from reflowshock.fem.elements.tetrahedron import QUADRATIC_SHARE, TETRAHEDRON, Tetrahedron, quadratic_derivatives
from reflowshock.fem.forces.force_congruent import SIGNS
from reflowshock.fem.forces.lanes import Lanes
from reflowshock.fem.kernels.hexahedron import GAUSS, GAUSS_DERIVATIVES
from reflowshock.fem.kernels.nonlinear_gradient import Blocks
from reflowshock.fem.kernels.nonlinear_hexahedron import POINT, HexahedronBlocks
from reflowshock.fem.kernels.nonlinear_one_point import OnePointBlocks
from reflowshock.fem.kernels.vectors.vector import WIDTH

# Degree 2 (Hammer, Marlowe & Stroud 1956): exact for the stiffness of straight-edged 10-node tetrahedra.
FOUR_POINTS = np.full((4, 4), (5.0 - np.sqrt(5.0)) / 20.0) + np.eye(4) / np.sqrt(5.0)
TEN_NODES = Tetrahedron(
    "tetrahedron_quadratic", quadratic_derivatives(FOUR_POINTS), np.full(4, 1.0 / 24.0), QUADRATIC_SHARE
)
SYMMETRIC = (np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2]))  # rows and columns of xx yy zz xy yz xz
ORTHOTROPIC = (np.append(SYMMETRIC[0], [3, 4, 5]), np.append(SYMMETRIC[1], [3, 4, 5]))
# Parities of the modes xy, xz, yz, xyz; their indices and signs among the amplitudes of ``one_point``.
HOURGLASS_PARITY, AMPLITUDES, HANDEDNESS = [3, 5, 6, 7], [2, 1, 0, 3], np.array([1.0, 1.0, 1.0, -1.0])
LINEAR = [0, 1, 3]  # indices of the modes x, y, z among the parities from 1 on
MODES, PAIRS = np.arange(4), np.triu_indices(4, 1)


def merge_equal_materials(elements: Elements, plastic: NDArray[np.float64]) -> tuple[Elements, NDArray[np.float64]]:
    """Merge equal materials, since many parts share one.

    Args:
        elements: Elements with the index of their material, and the elasticity of nm materials, shape (nm, 6, 6) [Pa];
            not changed.
        plastic: 3 G, A, B [Pa], n, C and reference rate [1/s] of each material (Johnson and Cook), shape (nm, 6).

    Returns:
        Elements with elasticity and material numbers of the nd distinct materials, and their plastic constants, shape
        (nd, 6).
    """
    constants = np.column_stack([elements.elasticity.reshape(len(plastic), -1), plastic])
    _, first, material = np.unique(constants, axis=0, return_index=True, return_inverse=True)
    material = material.reshape(-1)[elements.material].astype(np.int32)
    return replace(elements, material=material, elasticity=elements.elasticity[first]), plastic[first]


def gradient_blocks(elements: Elements, lanes: Lanes, plastic: NDArray[np.float64], finite: bool) -> Blocks:
    """Return stress-free tetrahedra in blocks of sixteen, the arguments of the nonlinear kernels.

    Args:
        elements: Tetrahedra with 4 or 10 nodes.
        lanes: Their order in blocks of sixteen lanes, from ``arrange``.
        plastic: 3 G, A, B [Pa], n, C and reference rate [1/s] of each material (Johnson and Cook), shape (nm, 6).
        finite: Whether kinematics are finite (the state then holds stretches) instead of small.

    Raises:
        ValueError: The elasticity of a material couples normal strain and shear, or two shears.
    """
    corners, kind = elements.points[elements.cells[lanes.shape]], elements.kind
    gradient, determinant = (TETRAHEDRON if kind.nodes == 4 else TEN_NODES).gradients(corners)
    weight = determinant / (6.0 * determinant.shape[1])
    points = gradient.shape[1]
    return Blocks(
        **_common_arrays(elements, lanes, plastic),
        gradient=lanes.spread(gradient.reshape(len(corners), points, -1)),
        weight=lanes.spread(weight[:, :, None]),
        state=initial_state(lanes, points, finite),
        plastic_work=np.zeros(lanes.element.shape),
    )


def one_point_blocks(elements: Elements, lanes: Lanes, plastic: NDArray[np.float64], finite: bool) -> OnePointBlocks:
    """Return stress-free one-point hexahedra in blocks of ``WIDTH`` lanes, the arguments of the nonlinear kernels.

    Args:
        elements: Hexahedra of the one-point formulation.
        lanes: Their order in blocks of ``WIDTH`` lanes, from ``arrange``.
        plastic: 3 G, A, B [Pa], n, C and reference rate [1/s] of each material (Johnson and Cook), shape (nm, 6).
        finite: Whether kinematics are finite (the state then holds stretches) instead of small.

    Raises:
        ValueError: The elasticity of a material couples normal strain and shear, or two shears.
    """
    shapes = elements.subset(lanes.shape)
    volume = element_geometry(shapes.points, shapes.cells).volume
    return OnePointBlocks(
        **_common_arrays(elements, lanes, plastic),
        constants=lanes.spread(hexahedron_constants(shapes)[:, None])[:, 0],
        weight=lanes.spread(volume[:, None, None]),
        state=initial_state(lanes, 1, finite),
        plastic_work=np.zeros(lanes.element.shape),
        hourglass_energy=np.zeros(lanes.element.shape),
        slip=_written_zeros(len(lanes.filled), 12 * WIDTH),
        modulus=1.0 / np.linalg.inv(elements.elasticity)[:, 0, 0],
    )


def hexahedron_constants(shapes: Elements) -> NDArray[np.float64]:
    """Return the constants of hexahedra of each shape for the kernels with one mean deformation and hourglass modes.

    Args:
        shapes: One hexahedron of each shape, ns of them.

    Returns:
        Shape (ns, 120): volume times the nine orthotropic constants [J]; mean gradients of the nodal modes of parity 1
        to 7, 21 entries [1/m]; corner positions in the modes xy, xz, yz, xyz, 12 entries [m]; hourglass stiffness of
        their amplitudes, 24 entries of the diagonal blocks and 54 of the others [N/m].
    """
    corners = shapes.points[shapes.cells]
    geometry = element_geometry(shapes.points, shapes.cells)
    rigidity = geometry.volume[:, None] * elastic_constants(shapes.elasticity)[shapes.material]
    gradient = np.einsum("pa,saj->spj", SIGNS[1:], geometry.gradient) / 8.0
    transformed = np.einsum("ka,saj->skj", SIGNS[HOURGLASS_PARITY], corners - corners[:, :1])
    _, stiffness = hourglass_control(corners, shapes.elasticity, shapes.material)
    tensor = stiffness.reshape(-1, 4, 3, 4, 3)[:, AMPLITUDES][:, :, :, AMPLITUDES]
    tensor = np.einsum("k,skilj,l->skilj", HANDEDNESS, tensor, HANDEDNESS, optimize=True) / 8.0
    blocks = tensor.transpose(0, 1, 3, 2, 4)
    diagonal, pairs = blocks[:, MODES, MODES][..., SYMMETRIC[0], SYMMETRIC[1]], blocks[:, PAIRS[0], PAIRS[1]]
    flat = (values.reshape(len(corners), -1) for values in (gradient, transformed, diagonal, pairs))
    return np.column_stack([rigidity, *flat])


def in_modes(amplitudes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert hourglass amplitudes from the modes yz, xz, xy, xyz of ``one_point`` to the unscaled xy, xz, yz, xyz.

    Args:
        amplitudes: Amplitudes, mode by mode with three components each, shape (ne, 12) [m].

    Returns:
        Amplitudes in the same storage, shape (ne, 12) [m].
    """
    ordered = amplitudes.reshape(-1, 4, 3)[:, AMPLITUDES] * HANDEDNESS[:, None]
    return np.sqrt(8.0) * ordered.reshape(amplitudes.shape)


def hexahedron_blocks(elements: Elements, lanes: Lanes, plastic: NDArray[np.float64]) -> HexahedronBlocks:
    """Return stress-free, fully integrated hexahedra in blocks of sixteen, the arguments of the nonlinear kernels.

    Args:
        elements: Hexahedra with incompatible modes.
        lanes: Their order in blocks of sixteen lanes, from ``arrange``.
        plastic: 3 G, A, B [Pa], n, C and reference rate [1/s] of each material (Johnson and Cook), shape (nm, 6).

    Raises:
        ValueError: The elasticity of a material couples normal strain and shear, or two shears.
    """
    corners = elements.points[elements.cells[lanes.shape]]
    count = len(corners)
    weight = np.linalg.det(np.einsum("eai,gad->egid", corners, GAUSS_DERIVATIVES, optimize=True))
    coupling = np.einsum("gk,gl,eg->ekl", GAUSS, GAUSS, 1.0 / weight)[:, SYMMETRIC[0], SYMMETRIC[1]]
    transformed = np.einsum("pa,eai->epi", SIGNS[1:], corners - corners[:, :1])
    inverse = np.linalg.inv(transformed[:, LINEAR].transpose(0, 2, 1))
    at_rest = lanes.spread(transformed.reshape(count, 1, -1))[:, 0]
    return HexahedronBlocks(
        **_common_arrays(elements, lanes, plastic),
        corners=at_rest,
        inverse=lanes.spread(inverse.reshape(count, 1, -1))[:, 0],
        weight=lanes.spread(weight[:, :, None]),
        reciprocal=lanes.spread(1.0 / weight[:, :, None]),
        basis=lanes.spread(_orthonormal_basis(weight).reshape(count, 1, -1))[:, 0],
        coupling=lanes.spread(coupling[:, None])[:, 0],
        state=_written_zeros(len(lanes.filled), 8, POINT),
        place=at_rest[lanes.pattern],
        plastic_work=np.zeros(lanes.element.shape),
        hourglass_energy=np.zeros(lanes.element.shape),
    )


def gauss_volumes(position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the volumes at the Gauss points of hexahedra up to a common factor, shape (k, 8).

    Args:
        position: Walsh-Hadamard transform of the corner positions, parities 1 to 7 (bit d: odd along direction d; order
            x, y, xy, z, xz, yz, xyz), shape (k, 7, 3) [m].
    """
    corners = np.einsum("pa,kpi->kai", SIGNS[1:], position)
    return np.linalg.det(np.einsum("kai,gad->kgid", corners, GAUSS_DERIVATIVES, optimize=True))


def _common_arrays(elements: Elements, lanes: Lanes, plastic: NDArray[np.float64]) -> dict[str, NDArray]:
    """Return the arrays common to blocks of all kinds by name; ``plastic (nm, 6)`` as in ``materials.plasticity``."""
    return {
        "cells": lanes.nodes(elements),
        "filled": lanes.filled,
        "pattern": lanes.pattern,
        "material": np.ascontiguousarray(elements.material[lanes.element[:, 0]]),
        "elastic": elastic_constants(elements.elasticity),
        "plastic": plastic,
    }


def _written_zeros(*shape: int) -> NDArray[np.float64]:
    """Return zeros that are written: unwritten pages share one physical page, which some processors read slowly."""
    return np.full(shape, 0.0)


def _orthonormal_basis(weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return 1, xi, eta, zeta at the Gauss points, orthonormalised with weights ``(ns, 8)``, shape (ns, 4, 8)."""
    functions = np.column_stack([np.ones(8), GAUSS])
    root = np.sqrt(weight)[:, :, None]
    return (np.linalg.qr(functions * root)[0] / root).transpose(0, 2, 1)


def elastic_constants(elasticity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the nine constants of orthotropic materials.

    Args:
        elasticity: Elasticity of each material, rows xx, yy, zz, xy, yz, xz, shape (nm, 6, 6) [Pa].

    Returns:
        C_xx, C_yy, C_zz, C_xy, C_yz, C_xz (normal), G_xy, G_yz, G_xz of each material, shape (nm, 9) [Pa].

    Raises:
        ValueError: A material couples normal strain and shear, or two shears: its axes are not x, y, z.
    """
    rest = elasticity.copy()
    rest[:, ORTHOTROPIC[0], ORTHOTROPIC[1]] = rest[:, ORTHOTROPIC[1], ORTHOTROPIC[0]] = 0.0
    if np.abs(rest).max(initial=0.0) > 1e-9 * np.abs(elasticity).max(initial=0.0):
        raise ValueError("elasticity couples normal strain and shear; nonlinear elements take axes along x, y, z only")
    return np.ascontiguousarray(elasticity[:, ORTHOTROPIC[0], ORTHOTROPIC[1]])


def initial_state(lanes: Lanes, points: int, finite: bool) -> NDArray[np.float64]:
    """Return the stress-free state of elements in blocks.

    Args:
        lanes: Order of the elements in nb blocks of ``width`` lanes, from ``arrange``.
        points: Number of integration points m of an element.
        finite: Whether strains are finite; the stretches of the state are then the identity, otherwise 0 and not used.

    Returns:
        State, shape (nb, m, 13 width), entry k of element e at ``width * k + e``: stress xx, yy, zz, xy, yz, xz [Pa],
        equivalent plastic strain, stretch in the order of the stress.
    """
    state = _written_zeros(len(lanes.filled), points, 13 * lanes.width)
    state[:, :, 7 * lanes.width : 10 * lanes.width] = float(finite)
    return state
