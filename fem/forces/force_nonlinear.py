"""Internal force of elements that yield or turn: a path at each integration point.

A 4-node tetrahedron has one constant strain: where it flows at constant volume it is too stiff, as at nu = 0.5
(locking); use the 10-node one (four points, straight edges) or hexahedra for parts that yield.

Stress lives in the frame of the polar rotation, so that rotations of any size give no strain. The one-point hexahedron
is twice as fast as the fully integrated one. Its hourglass forces yield as a section does: a plastic hinge has
3 % too much moment, not 29 %.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements
from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.elements.stress import symmetric, von_mises
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.forces.nonlinear_blocks import (
    Lanes,
    alike,
    arrange,
    gauss_volumes,
    gradient_blocks,
    hexahedron_blocks,
    one_point_blocks,
)
from reflowshock.fem.kernels.lanes import LANES
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.kernels.nonlinear_gradient import FINE, Blocks, add_gradient_force
from reflowshock.fem.kernels.nonlinear_hexahedron import HexahedronBlocks, add_hexahedron_force
from reflowshock.fem.kernels.nonlinear_one_point import OnePointBlocks, add_one_point_force
from reflowshock.fem.parallel.checkpoint_state import Rows
from reflowshock.materials.plasticity import NEVER_YIELDS

AnyBlocks = Blocks | OnePointBlocks | HexahedronBlocks
HISTORY = {  # name in checkpoints -> array of blocks that have it
    "state": "state",
    "work": "plastic_work",
    "hourglass": "hourglass_energy",
    "place": "place",
    "slip": "slip",
}
RIGID = 1e30  # factor on the stiffness of incompatible modes that are to stay


@dataclass(frozen=True, slots=True)
class NonlinearElements:
    """Elements with a path.

    Attributes:
        elements: The elements.
        numbers: ``(ne,)`` their numbers among all elements of the rank.
        path: Kinematics and step.
        elasticity: ``(nm, 6, 6)`` [Pa] of the materials of blocks: equal ones of ``elements`` are one.
        lanes: Their order.
        blocks: What the kernel works on.
        kernel: Subtracts the force at a displacement; returns ``FINE`` or the block with an inverted element.
        history: State, plastic work [J], and what else has a path.
    """

    elements: Elements
    numbers: NDArray[np.int64]
    path: Path
    elasticity: NDArray[np.float64]
    lanes: Lanes
    blocks: AnyBlocks
    kernel: Callable[[NDArray[np.float64], NDArray[np.float64]], int]
    history: dict[str, NDArray]

    @classmethod
    def build(
        cls, everything: Elements, chosen: NDArray[np.int64], plastic: NDArray[np.float64], path: Path
    ) -> "NonlinearElements":
        """Start from rest, without stress.

        Args:
            everything: The elements of a rank.
            chosen: ``(ne,)`` which of them.
            plastic: ``(nm, 6)`` rows of ``materials.plasticity.plastic_constants``.
            path: Kinematics and step.
        """
        elements = everything.subset(chosen)
        same, laws = alike(elements, plastic)
        lanes, finite = arrange(same, same.material), path.finite
        blocks: AnyBlocks
        kernel: Callable[[NDArray[np.float64], NDArray[np.float64]], int]
        if elements.kind.name == HEXAHEDRON.name:
            blocks = hexahedron_blocks(same, lanes, laws)
            kernel = partial(add_hexahedron_force, blocks, path)
        elif elements.kind.hourglass:
            blocks = one_point_blocks(same, lanes, laws, finite)
            kernel = partial(add_one_point_force, blocks, path)
        else:
            blocks = gradient_blocks(same, lanes, laws, finite)
            kernel = partial(add_gradient_force, blocks, tuple(range(elements.kind.nodes)), path)
        history = {name: getattr(blocks, kept) for name, kept in HISTORY.items() if hasattr(blocks, kept)}
        return cls(elements, chosen, path, same.elasticity, lanes, blocks, kernel, history)

    @property
    def finite(self) -> bool:
        """Return whether rotations and strains are finite."""
        return self.path.finite

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force; the path goes on by a step.

        Raises:
            InvertedElementError: An element is turned inside out.
        """
        block = self.kernel(displacement, force)
        if block != FINE:
            raise self.inverted(block, displacement)

    @property
    def arrays(self) -> dict[str, Any]:
        """Return its entries of ``kernels.levels.ForceArrays``; none where it has no place there."""
        kinds = {OnePointBlocks: "one_point", HexahedronBlocks: "hexahedron"}
        kind = kinds.get(type(self.blocks))
        return {kind: self.blocks, "path": self.path} if kind else {}

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the energies at the latest ``add``."""
        blocks, valid = self.blocks, self.lanes.valid
        return Energy(
            strain=float(elastic_energy(blocks, self.elasticity)[valid].sum()),
            plastic=float(blocks.plastic_work[valid].sum()),
            hourglass=float(self.history["hourglass"][valid].sum()) if "hourglass" in self.history else 0.0,
        )

    def state(self, cells: NDArray[np.int64]) -> dict[str, Rows]:
        """Return the history by element, for a checkpoint; ``cells`` are the input numbers of the rank's elements."""
        block, lane = np.nonzero(self.lanes.valid)
        numbers = cells[self.numbers[self.lanes.element[block, lane]]]
        return {name: Rows(numbers, by_lane(values)[block, lane]) for name, values in self.history.items()}

    def restore(self, state: Mapping[str, NDArray[np.float64]]) -> None:
        """Continue from the values of what ``state`` returned; lanes that repeat an element get its history, too."""
        block, lane = np.nonzero(self.lanes.valid)
        row = np.empty(len(self.numbers), np.int64)
        row[self.lanes.element[block, lane]] = np.arange(len(block))
        for name, values in self.history.items():
            by_lane(values)[...] = state[name][row[self.lanes.element]]

    def located(self, places: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return block and lane of some elements; ``places (k,)`` are positions among this term's elements."""
        block, lane = np.nonzero(self.lanes.valid)
        row = np.empty(len(self.numbers), np.int64)
        row[self.lanes.element[block, lane]] = np.arange(len(block))
        return block[row[places]], lane[row[places]]

    def points(self, block: NDArray[np.int64], lane: NDArray[np.int64]) -> "PointValues":
        """Return the values at the integration points of elements found by ``located``."""
        blocks = self.blocks
        points = blocks.state.shape[1]
        state = blocks.state.reshape(len(blocks.state), points, -1, LANES)[block, :, :, lane]
        weight = blocks.weight[blocks.pattern[block]].reshape(-1, points, LANES)[np.arange(len(block)), :, lane]
        work = blocks.plastic_work[block, lane] / weight.sum(axis=1)
        return PointValues(weight, state[..., :6], state[..., 6], work, self.ratios(block, lane))

    def ratios(self, block: NDArray[np.int64], lane: NDArray[np.int64]) -> NDArray[np.float64] | float:
        """Return the volume at the integration points over that at rest; 1 where strains are small."""
        blocks = self.blocks
        if not self.finite:
            return 1.0
        if isinstance(blocks, HexahedronBlocks):
            places = (
                by_lane(values)[row, lane]
                for values, row in ((blocks.place, block), (blocks.corners, blocks.pattern[block]))
            )
            now, rest = (gauss_volumes(place.reshape(-1, 7, 3)) for place in places)
            return now / rest
        stretch = by_lane(blocks.state)[block, lane][..., 7:13]
        return np.linalg.det(symmetric(stretch.reshape(-1, 6))).reshape(stretch.shape[:-1])

    def means(self, places: NDArray[np.integer]) -> "Means":
        """Return mean values over some elements; ``places (k,)`` as in ``located``."""
        found = self.points(*self.located(places))
        share = found.weight / found.weight.sum(axis=1)[:, None]
        stress = np.einsum("km,kmc->kc", share, found.stress)
        return Means(stress, np.einsum("km,km->k", share, found.plastic_strain), found.plastic_work)

    def frozen(self, places: NDArray[np.integer]) -> "NonlinearElements":
        """Return a term of some elements whose force at the displacement of the latest ``add`` is what it was there.

        It does not flow, and its modes stay; ``take_path`` gives it their state.
        """
        plastic = np.tile(NEVER_YIELDS, (len(self.elements.elasticity), 1))
        made = NonlinearElements.build(self.elements, places.astype(np.int64), plastic, Path(self.finite, np.inf))
        if isinstance(made.blocks, HexahedronBlocks):
            made.blocks.coupling[...] *= RIGID
        return made

    def take_path(self, other: "NonlinearElements", block: NDArray[np.int64], lane: NDArray[np.int64]) -> None:
        """Take the history of the elements of another term, found by its ``located``, in the order of this one's."""
        order = self.lanes.element
        for name, values in self.history.items():
            by_lane(values)[...] = by_lane(other.history[name])[block[order], lane[order]]

    def inverted(self, block: int, displacement: NDArray[np.float64]) -> InvertedElementError:
        """Return the error that names the worst element of a block."""
        elements, places = self.elements, self.lanes.element[block]
        cells = elements.cells[places]
        lowest = elements.kind.geometry((elements.points + displacement)[cells]).lowest
        worst = int(np.argmin(lowest))
        place = ", ".join(f"{value:.6g}" for value in elements.points[cells[worst]].mean(axis=0))
        return InvertedElementError(
            f"element {self.numbers[places[worst]]}, at first near ({place}) m, is turned inside out (lowest Jacobian"
            f" determinant {lowest[worst]:.3e} m^3)"
        )


@dataclass(frozen=True, slots=True)
class PointValues:
    """Values at the m integration points of elements.

    Attributes:
        weight: ``(k, m)`` [m^3].
        stress: ``(k, m, 6)`` [Pa] Kirchhoff stress in the frame that turns with the body.
        plastic_strain: ``(k, m)`` equivalent plastic strain.
        plastic_work: ``(k,)`` [J/m^3] of whole elements.
        ratio: ``(k, m)`` volume over that at rest, or 1.
    """

    weight: NDArray[np.float64]
    stress: NDArray[np.float64]
    plastic_strain: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    ratio: NDArray[np.float64] | float

    @property
    def mises(self) -> NDArray[np.float64]:
        """Return the von Mises stresses ``(k, m)`` [Pa] of the Cauchy stress, which no rotation changes."""
        result: NDArray[np.float64] = von_mises(self.stress.reshape(-1, 6)).reshape(self.weight.shape)
        return result / self.ratio


@dataclass(frozen=True, slots=True)
class Means:
    """Volume averages over elements.

    Attributes:
        stress: ``(k, 6)`` [Pa] Kirchhoff stress in the frame that turns with the body.
        plastic_strain: ``(k,)`` equivalent plastic strain.
        plastic_work: ``(k,)`` [J/m^3].
    """

    stress: NDArray[np.float64]
    plastic_strain: NDArray[np.float64]
    plastic_work: NDArray[np.float64]


def by_lane(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a view ``(nb, 16, m)`` or ``(nb, 16, p, m)`` of an array of blocks whose lanes are innermost."""
    split = values.reshape(*values.shape[:-1], -1, LANES)
    return np.moveaxis(split, -1, 1)


def elastic_energy(blocks: AnyBlocks, elasticity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the elastic energy s : C^-1 : s / 2 of each lane ``(nb, 16)`` [J]."""
    points = blocks.state.shape[1]
    stress = blocks.state.reshape(len(blocks.state), points, -1, LANES)[:, :, :6]
    strain = np.einsum("bij,bmjl->bmil", np.linalg.inv(elasticity)[blocks.material], stress, optimize=True)
    weight = blocks.weight[blocks.pattern].reshape(-1, points, LANES)
    return np.asarray(0.5 * np.einsum("bmil,bmil,bml->bl", stress, strain, weight, optimize=True))
