"""Corotational internal force of elastic hexahedra with finite rotations and small strains.

The linear stiffness of an element acts in the frame of its mean rotation: for boxes diagonalised by their symmetry
(``force_congruent``, ``kernels.box_rotation``), for other hexahedra split into mean strain and hourglass part
(``kernels.turned_hexahedron``). The force is the exact derivative of an energy and has no history. The neglected strain
is of second order, (U - 1)^2 / 2: 5e-5 at a strain of 1 %.

Boxes are stored in rows of equal boxes, whose neighbours share operations, or in blocks of any shapes, which are faster
on the graded board of jedec_bga, with three boxes per row.
"""

from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements, element_stiffness
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.forces.force_congruent import align_boxes, arrange_in_rows, is_box, parity_blocks
from reflowshock.fem.forces.lanes import arrange
from reflowshock.fem.forces.nonlinear_blocks import hexahedron_constants
from reflowshock.fem.kernels.box_rotation import (
    UPRIGHT,
    add_turned_row_forces,
    row_energies,
)
from reflowshock.fem.kernels.box_rows import PAD, read_lines, subtract_lines
from reflowshock.fem.kernels.turned_hexahedron import add_turned_forces, turned_energies
from reflowshock.fem.kernels.vectors.box import add_turned_block_forces, block_energies
from reflowshock.fem.kernels.vectors.vector import WIDTH

SHORT_ROWS = 8  # mean number of boxes per row below which blocks of any shapes are used
NORMAL = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
# Parity and entries (00 01 02 11 12 22) of the blocks that resist the modes xy, xz, yz, xyz.
HIGHER = ((7, (0, 1, 2, 3, 4, 5)), (1, (3, 4, 5)), (2, (0, 2, 5)), (4, (0, 1, 3)), (6, (0,)), (5, (3,)), (3, (5,)))


@dataclass(frozen=True, slots=True)
class CorotationalBoxes:
    """Corotational boxes that share stiffnesses, in rows along the axis with the longest rows.

    Attributes:
        points: Nodes, shape (n, 3) [m].
        axes: Coordinate directions in the order of the frame of the rows, shape (3,).
        nodes: Node at each position of the lines, shape (p,) int32.
        rows: Rows of boxes, see ``kernels.box_rows.add_row_forces``, shape (nr, 6) int32.
        scales: -1 / (4 h) along each direction of the frame of the rows, shape (ns, 3) [1/m].
        constants: Constants of each shape, see ``box_constants``, shape (ns, 27).
        lines: Work space for displacements [m] and forces [N] at the positions, shape (2, 3, p + PAD).
        hourglass: Whether the energy of the higher modes counts as hourglass energy.
        numbers: Number of each box among all elements of the rank, shape (ne,).
        history: Empty, because the force follows from the displacement.
    """

    points: NDArray[np.float64]
    axes: NDArray[np.int64]
    nodes: NDArray[np.int32]
    rows: NDArray[np.int32]
    scales: NDArray[np.float64]
    constants: NDArray[np.float64]
    lines: NDArray[np.float64]
    hourglass: bool
    numbers: NDArray[np.int64]
    history: dict[str, NDArray] = field(default_factory=dict)

    @classmethod
    def build(cls, everything: Elements, chosen: NDArray[np.int64]) -> "CorotationalBoxes":
        """Group the ``chosen (ne,)`` elements, boxes (``force_congruent.is_box``), into shapes and rows."""
        elements = everything.subset(chosen)
        ahead, axes, box_rows, first = arrange_in_rows(elements)
        shapes = ahead.subset(first)
        size = np.ptp(shapes.points[shapes.cells], axis=1)
        lines = np.zeros((2, 3, len(box_rows.nodes) + PAD))
        constants = box_constants(shapes, size)
        return cls(
            elements.points,
            np.array(axes),
            box_rows.nodes,
            box_rows.rows,
            -0.25 / size,
            constants,
            lines,
            elements.kind.hourglass,
            chosen,
        )

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force at a displacement ``(n, 3)`` [m] from ``force (n, 3)`` [N].

        Raises:
            InvertedElementError: A box is turned inside out.
        """
        read_lines(self.nodes, self.axes, displacement, self.lines[0])
        row = add_turned_row_forces(self.rows, self.scales, self.constants, *self.lines)
        if row != UPRIGHT:
            raise self.inverted(row, displacement)
        subtract_lines(self.nodes, self.axes, self.lines[1], force)

    @property
    def arrays(self) -> dict[str, tuple[NDArray, ...]]:
        """Entry of ``kernels.levels.ForceArrays`` by name."""
        return {"turning_rows": (self.nodes, self.axes, self.rows, self.scales, self.constants, self.lines)}

    def inverted(self, row: int, displacement: NDArray[np.float64]) -> InvertedElementError:
        """Return the error of a row with a box that is turned inside out."""
        return inverted("the row", self.points[self.nodes[self.rows[row, 0]]])

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy."""
        read_lines(self.nodes, self.axes, displacement, self.lines[0])
        return _split_energies(row_energies(self.rows, self.scales, self.constants, self.lines[0]), self.hourglass)


@dataclass(frozen=True, slots=True)
class TurningBlocks:
    """Corotational hexahedra in blocks of ``WIDTH`` lanes; base class of boxes and other shapes.

    Attributes:
        points: Nodes, shape (n, 3) [m].
        cells: Nodes of each lane, shape (nb, 8, WIDTH) int32.
        filled: Number of elements of each block, shape (nb,) int32.
        pattern: Pattern of each block, shape (nb,) int32; blocks of equal shapes share one.
        constants: The m entries of ``constants_of`` for each lane of a pattern, lanes innermost, shape (np, WIDTH m).
        hourglass: Whether the energy of the higher modes counts as hourglass energy.
        numbers: Number of each element among all elements of the rank, shape (ne,).
        history: Empty, because the force follows from the displacement.
        forces: Kernel that subtracts the internal force.
        energies: Kernel that returns the energies of mean strains and higher modes [J].
        entry: Name of the arrays in ``kernels.levels.ForceArrays``.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    filled: NDArray[np.int32]
    pattern: NDArray[np.int32]
    constants: NDArray[np.float64]
    hourglass: bool
    numbers: NDArray[np.int64]
    history: dict[str, NDArray] = field(default_factory=dict)
    forces: ClassVar[Any]
    energies: ClassVar[Any]
    entry: ClassVar[str]

    @staticmethod
    def ordered(elements: Elements) -> Elements:
        """Return the elements with nodes in the order of the kernels; here without change."""
        return elements

    @staticmethod
    def constants_of(shapes: Elements) -> NDArray[np.float64]:
        """Return the constants of each shape for the kernels, shape (ns, m), from one element per shape."""
        raise NotImplementedError

    @classmethod
    def build(cls, everything: Elements, chosen: NDArray[np.int64]) -> Self:
        """Return the elements numbered ``chosen (ne,)`` in blocks."""
        elements = cls.ordered(everything.subset(chosen))
        lanes = arrange(elements, np.zeros(len(chosen), np.int32), WIDTH)
        constants = lanes.spread(cls.constants_of(elements.subset(lanes.shape))[:, None])[:, 0]
        arrays = lanes.nodes(elements), lanes.filled, lanes.pattern, constants
        return cls(elements.points, *arrays, elements.kind.hourglass, chosen)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force at a displacement ``(n, 3)`` [m] from ``force (n, 3)`` [N].

        Raises:
            InvertedElementError: An element is turned inside out.
        """
        block = self.forces(self.blocks, displacement, force)
        if block != UPRIGHT:
            raise self.inverted(block, displacement)

    @property
    def blocks(self) -> tuple[NDArray, ...]:
        """First arguments of the kernels."""
        return self.cells, self.filled, self.pattern, self.constants

    @property
    def arrays(self) -> dict[str, tuple[NDArray, ...]]:
        """Entry of ``kernels.levels.ForceArrays`` by name."""
        return {self.entry: self.blocks}

    def inverted(self, block: int, displacement: NDArray[np.float64]) -> InvertedElementError:
        """Return the error of a block with an element that is turned inside out."""
        return inverted("a block", self.points[self.cells[block, 0, 0]])

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy."""
        return _split_energies(self.energies(self.blocks, displacement), self.hourglass)


class CorotationalBlocks(TurningBlocks):
    """Boxes (``force_congruent.is_box``), for meshes whose rows of equal boxes are short."""

    __slots__ = ()
    forces, energies = staticmethod(add_turned_block_forces), staticmethod(block_energies)
    entry = "turning_boxes"

    @staticmethod
    def ordered(elements: Elements) -> Elements:
        """Return the boxes renumbered so that bit d of a local index is the side in direction d."""
        return align_boxes(elements)

    @staticmethod
    def constants_of(shapes: Elements) -> NDArray[np.float64]:
        """Return ``box_constants`` followed by the scales of ``CorotationalBoxes``, shape (ns, 30)."""
        size = np.ptp(shapes.points[shapes.cells], axis=1)
        return np.column_stack([box_constants(shapes, size), -0.25 / size])


class CorotationalHexahedra(TurningBlocks):
    """Hexahedra of any shapes."""

    __slots__ = ()
    forces, energies = staticmethod(add_turned_forces), staticmethod(turned_energies)
    entry = "turning"

    @staticmethod
    def constants_of(shapes: Elements) -> NDArray[np.float64]:
        """Return ``hexahedron_constants``: ``(ns, 120)``."""
        return hexahedron_constants(shapes)


Corotational = CorotationalBoxes | CorotationalBlocks | CorotationalHexahedra


def corotational_terms(everything: Elements, chosen: NDArray[np.bool_]) -> list[Corotational]:
    """Return the force terms of selected hexahedra: one for boxes and one for other shapes; empty if none is selected.

    Args:
        everything: All elements of this rank, hexahedra where selected.
        chosen: Whether an element is selected, shape (ne,).
    """
    box = is_box(everything.points[everything.cells])
    boxes, others = np.flatnonzero(chosen & box), np.flatnonzero(chosen & ~box)
    terms: list[Corotational] = [corotational_boxes(everything, boxes)] if len(boxes) else []
    return [*terms, CorotationalHexahedra.build(everything, others)] if len(others) else terms


def corotational_boxes(everything: Elements, chosen: NDArray[np.int64]) -> CorotationalBoxes | CorotationalBlocks:
    """Return one force term of selected boxes: in rows, or in blocks of sixteen if rows have fewer than 8 on average.

    Args:
        everything: All elements of this rank.
        chosen: Numbers of the selected boxes among all elements, at least one, shape (k,).
    """
    rows = CorotationalBoxes.build(everything, chosen)
    return rows if len(chosen) >= SHORT_ROWS * len(rows.rows) else CorotationalBlocks.build(everything, chosen)


def _split_energies(energies: tuple[float, float], hourglass: bool) -> Energy:
    """Return the energies of mean strains and higher modes [J] as strain energy, the latter optionally as hourglass."""
    mean, higher = energies
    return Energy(strain=mean, hourglass=higher) if hourglass else Energy(strain=mean + higher)


def inverted(group: str, start: NDArray[np.float64]) -> InvertedElementError:
    """Return the error, not raised here, of a group of elements of which one is turned inside out.

    Args:
        group: Kind of the group in the message, such as "the row" or "the block".
        start: First node of the group, shape (3,) [m].
    """
    coordinates = ", ".join(f"{value:.6g}" for value in start)
    return InvertedElementError(f"an element in {group} that begins near ({coordinates}) m is turned inside out")


def box_constants(shapes: Elements, size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the constants of the corotational force of boxes.

    Args:
        shapes: One box of each shape, ns of them, nodes in tensor order, in the frame of the rows.
        size: Edge lengths of each shape, shape (ns, 3) [m].

    Returns:
        Volume V times C_xx, C_yy, C_zz, C_xy, C_yz, C_xz, G_xy, G_yz, G_xz [J], then the 18 stiffnesses of the modes
        xy, xz, yz, xyz in the order of ``HIGHER`` [N/m], shape (ns, 27).
    """
    elasticity = shapes.elasticity[shapes.material] * size.prod(axis=1)[:, None, None]
    rows, columns = np.transpose((*NORMAL, (3, 3), (4, 4), (5, 5)))
    blocks = parity_blocks(element_stiffness(shapes))
    parts = [elasticity[:, rows, columns], *(blocks[:, parity, entries] for parity, entries in HIGHER)]
    return np.ascontiguousarray(np.column_stack(parts))
