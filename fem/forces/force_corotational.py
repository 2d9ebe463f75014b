"""Internal force of elastic hexahedra that turn by any angle and strain little, at a few times the cost of linear ones.

The linear stiffness of an element acts in the frame of its mean rotation: of boxes diagonalised by their symmetry
(``force_congruent``, ``kernels.box_rotation``), of other hexahedra as mean strain and hourglass part
(``kernels.turned_hexahedron``). The force is the exact derivative of an energy and needs no path. What it leaves out is
of second order in the strain, (U - 1)^2 / 2: a strain of 1 % is wrong by 5e-5.

Boxes stand in rows of equal ones, whose neighbours share work, or in blocks of any shapes: on the graded board of
jedec_bga, with three boxes a row, blocks are 2.3 times as fast; from 24 boxes a row on, rows are.
"""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements, classes, element_stiffness
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.forces.force_congruent import aligned, arranged, is_box, parity_blocks
from reflowshock.fem.forces.nonlinear_blocks import hexahedron_constants, in_blocks
from reflowshock.fem.kernels.box_rotation import (
    UPRIGHT,
    add_turned_block_forces,
    add_turned_row_forces,
    block_energies,
    row_energies,
)
from reflowshock.fem.kernels.box_rows import PAD, read_lines, subtract_lines
from reflowshock.fem.kernels.turned_hexahedron import add_turned_forces, turned_energies

SHORT_ROWS = 8  # boxes of a row, in the mean, below which blocks of any shapes are faster
NORMAL = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
# Parity and entries (00 01 02 11 12 22) of the blocks that resist the modes xy, xz, yz, xyz.
HIGHER = ((7, (0, 1, 2, 3, 4, 5)), (1, (3, 4, 5)), (2, (0, 2, 5)), (4, (0, 1, 3)), (6, (0,)), (5, (3,)), (3, (5,)))


@dataclass(frozen=True, slots=True)
class CorotationalBoxes:
    """Boxes that share stiffnesses and turn, in rows along the axis that has the longest ones.

    Attributes:
        points: ``(n, 3)`` [m].
        axes: ``(3,)`` coordinate directions in the order of the rows' frame.
        nodes: ``(p,)`` int32, node at each position of the lines.
        rows: ``(nr, 6)`` int32, see ``kernels.box_rows.add_row_forces``.
        scales: ``(ns, 3)`` [1/m], -1 / (4 h) along each direction of the rows' frame.
        constants: ``(ns, 27)``, see ``box_constants``.
        lines: ``(2, 3, p + PAD)`` displacements [m] and forces [N] at the positions, between calls of no meaning.
        hourglass: Whether the energy of the higher modes counts as that of hourglass control.
        numbers: ``(ne,)`` the boxes' numbers among all elements of the rank.
        history: Empty.
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
        ahead, axes, found, first = arranged(elements)
        shapes = ahead.subset(first)
        size = np.ptp(shapes.points[shapes.cells], axis=1)
        lines = np.zeros((2, 3, len(found.nodes) + PAD))
        constants = box_constants(shapes, size)
        hourglass = elements.kind.hourglass
        return cls(
            elements.points, np.array(axes), found.nodes, found.rows, -0.25 / size, constants, lines, hourglass, chosen
        )

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force.

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
        """Return its entry of ``kernels.levels.ForceArrays``."""
        return {"turning_rows": (self.nodes, self.axes, self.rows, self.scales, self.constants, self.lines)}

    def inverted(self, row: int, displacement: NDArray[np.float64]) -> InvertedElementError:
        """Return the error of a row with a box that is turned inside out."""
        return inverted("the row", self.points[self.nodes[self.rows[row, 0]]])

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy."""
        read_lines(self.nodes, self.axes, displacement, self.lines[0])
        return accounted(row_energies(self.rows, self.scales, self.constants, self.lines[0]), self.hourglass)


@dataclass(frozen=True, slots=True)
class TurningBlocks:
    """Hexahedra that turn, sixteen of any shapes side by side; subclasses say of what kind.

    Attributes:
        points: ``(n, 3)`` [m].
        cells: ``(nb, 8, 16)`` int32, see ``forces``.
        filled: ``(nb,)`` int32 elements of each block.
        constants: ``(nb, 16 m)`` of each lane the m entries of ``constants_of``.
        hourglass: Whether the energy of the higher modes counts as that of hourglass control.
        numbers: ``(ne,)`` the elements' numbers among all of the rank.
        history: Empty.
        forces: Kernel that subtracts the force.
        energies: Kernel of the energies of mean strains and higher modes.
        entry: Of ``kernels.levels.ForceArrays``.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    filled: NDArray[np.int32]
    constants: NDArray[np.float64]
    hourglass: bool
    numbers: NDArray[np.int64]
    history: dict[str, NDArray] = field(default_factory=dict)
    forces: ClassVar[Any]
    energies: ClassVar[Any]
    entry: ClassVar[str]

    @staticmethod
    def ordered(elements: Elements) -> Elements:
        """Return the elements with their nodes in the order that the kernels want: as they are."""
        return elements

    @staticmethod
    def constants_of(shapes: Elements) -> NDArray[np.float64]:
        """Return what the kernels need of an element of each shape: ``(ns, m)``."""
        raise NotImplementedError

    @classmethod
    def build(cls, everything: Elements, chosen: NDArray[np.int64]) -> Self:
        """Put the ``chosen (ne,)`` elements into blocks."""
        elements = cls.ordered(everything.subset(chosen))
        element, filled = in_blocks(np.argsort(elements.cells.min(axis=1), kind="stable"))
        first, shape = classes(replace(elements, density=np.zeros(len(elements.cells))))
        cells = np.ascontiguousarray(elements.cells[element].transpose(0, 2, 1), dtype=np.int32)
        constants = cls.constants_of(elements.subset(first))[shape[element]].transpose(0, 2, 1)
        by_block = np.ascontiguousarray(constants).reshape(len(element), -1)
        return cls(elements.points, cells, filled, by_block, elements.kind.hourglass, chosen)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force; errors as ``CorotationalBoxes.add``."""
        block = self.forces(self.cells, self.filled, self.constants, displacement, force)
        if block != UPRIGHT:
            raise self.inverted(block, displacement)

    @property
    def arrays(self) -> dict[str, tuple[NDArray, ...]]:
        """Return its entry of ``kernels.levels.ForceArrays``."""
        return {self.entry: (self.cells, self.filled, self.constants)}

    def inverted(self, block: int, displacement: NDArray[np.float64]) -> InvertedElementError:
        """Return the error of a block with an element that is turned inside out."""
        return inverted("a block", self.points[self.cells[block, 0, 0]])

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the strain energy."""
        return accounted(self.energies(self.cells, self.filled, self.constants, displacement), self.hourglass)


class CorotationalBlocks(TurningBlocks):
    """Boxes (``force_congruent.is_box``), for meshes whose rows of equal boxes are short."""

    __slots__ = ()
    forces, energies = staticmethod(add_turned_block_forces), staticmethod(block_energies)
    entry = "turning_boxes"

    @staticmethod
    def ordered(elements: Elements) -> Elements:
        """Return the boxes with bit d of a local index the side in direction d."""
        return aligned(elements)

    @staticmethod
    def constants_of(shapes: Elements) -> NDArray[np.float64]:
        """Return ``box_constants``, then scales as of ``CorotationalBoxes``: ``(ns, 30)``."""
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
    """Return the terms of the ``chosen (ne,)`` elements, hexahedra: of boxes and of others."""
    box = is_box(everything.points[everything.cells])
    boxes, others = np.flatnonzero(chosen & box), np.flatnonzero(chosen & ~box)
    terms: list[Corotational] = [corotational_boxes(everything, boxes)] if len(boxes) else []
    return [*terms, CorotationalHexahedra.build(everything, others)] if len(others) else terms


def corotational_boxes(everything: Elements, chosen: NDArray[np.int64]) -> CorotationalBoxes | CorotationalBlocks:
    """Return the term of the ``chosen (ne,)`` elements, boxes: in rows, unless these are short."""
    rows = CorotationalBoxes.build(everything, chosen)
    return rows if len(chosen) >= SHORT_ROWS * len(rows.rows) else CorotationalBlocks.build(everything, chosen)


def accounted(energies: tuple[float, float], hourglass: bool) -> Energy:
    """Return the energies of mean strains and higher modes [J], the latter as that of hourglass control or not."""
    mean, higher = energies
    return Energy(strain=mean, hourglass=higher) if hourglass else Energy(strain=mean + higher)


def inverted(what: str, start: NDArray[np.float64]) -> InvertedElementError:
    """Return the error of a row or block of boxes that begins at a point ``(3,)`` [m]."""
    place = ", ".join(f"{value:.6g}" for value in start)
    return InvertedElementError(f"an element in {what} that begins near ({place}) m is turned inside out")


def box_constants(shapes: Elements, size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what a force of boxes needs of each shape: ``(ns, 27)``.

    V C_xx, C_yy, C_zz, C_xy, C_yz, C_xz, G_xy, G_yz, G_xz [J], then the entries [N/m] of ``HIGHER`` in turn.

    Args:
        shapes: A box of each shape, aligned, in the rows' frame.
        size: ``(ns, 3)`` edges [m].
    """
    elasticity = shapes.elasticity[shapes.material] * size.prod(axis=1)[:, None, None]
    rows, columns = np.transpose((*NORMAL, (3, 3), (4, 4), (5, 5)))
    blocks = parity_blocks(element_stiffness(shapes))
    parts = [elasticity[:, rows, columns], *(blocks[:, parity, entries] for parity, entries in HIGHER)]
    return np.ascontiguousarray(np.column_stack(parts))
