"""Internal force of elements with plasticity or finite rotations, with a history at each integration point.

A 4-node tetrahedron has one constant strain: plastic flow at constant volume makes it too stiff (volumetric locking, as
at nu = 0.5); use the 10-node tetrahedron (four points, straight edges) or hexahedra for parts that yield.

Stress is stored in the frame of the polar rotation, so finite rotations cause no strain. The one-point hexahedron is
twice as fast as the fully integrated one. Its hourglass forces yield like a section under bending: the moment of a
plastic hinge is 3 % too large instead of 29 %.
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
from reflowshock.fem.forces.lanes import Lanes, arrange
from reflowshock.fem.forces.nonlinear_blocks import (
    gauss_volumes,
    gradient_blocks,
    hexahedron_blocks,
    merge_equal_materials,
    one_point_blocks,
)
from reflowshock.fem.kernels.lanes import LANES
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.kernels.nonlinear_gradient import FINE, Blocks, add_gradient_force
from reflowshock.fem.kernels.nonlinear_hexahedron import HexahedronBlocks, add_hexahedron_force
from reflowshock.fem.kernels.nonlinear_one_point import OnePointBlocks, add_one_point_force
from reflowshock.fem.kernels.vectors.vector import WIDTH
from reflowshock.fem.parallel.checkpoint_state import Rows
from reflowshock.materials.plasticity import NEVER_YIELDS

AnyBlocks = Blocks | OnePointBlocks | HexahedronBlocks
HISTORY = {  # name in checkpoints -> name of the array of the blocks
    "state": "state",
    "work": "plastic_work",
    "hourglass": "hourglass_energy",
    "place": "place",
    "slip": "slip",
}
RIGID = 1e30  # factor on the stiffness of incompatible modes that keep their amplitudes


@dataclass(frozen=True, slots=True)
class NonlinearElements:
    """Path-dependent elements, as a ``force.TermWithPath``.

    Attributes:
        elements: Elements of the term.
        numbers: Number of each element among all elements of the rank, shape (ne,).
        path: Kinematics and time step.
        elasticity: Elasticity of the distinct materials of the blocks, shape (nm, 6, 6) [Pa].
        lanes: Order of the elements in blocks.
        blocks: Arrays of the kernel.
        kernel: Function that subtracts the force at a displacement and returns ``FINE`` or a block with an inverted
            element.
        history: Arrays with history by name in checkpoints, e.g. state and plastic work [J].
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
        """Return elements at rest, without stress.

        Args:
            everything: All elements of a rank.
            chosen: Numbers of the elements of the term, shape (ne,).
            plastic: Rows of ``materials.plasticity.plastic_constants``, shape (nm, 6).
            path: Kinematics and time step.
        """
        elements = everything.subset(chosen)
        same, laws = merge_equal_materials(elements, plastic)
        width = WIDTH if elements.kind.hourglass else LANES
        lanes, finite = arrange(same, same.material, width), path.finite
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
        history = {name: getattr(blocks, array) for name, array in HISTORY.items() if hasattr(blocks, array)}
        return cls(elements, chosen, path, same.elasticity, lanes, blocks, kernel, history)

    @property
    def finite(self) -> bool:
        """Whether rotations and strains are finite."""
        return self.path.finite

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force at a displacement ``(n, 3)`` [m] from ``force (n, 3)`` [N], update the history.

        Raises:
            InvertedElementError: An element is turned inside out.
        """
        block = self.kernel(displacement, force)
        if block != FINE:
            raise self.inverted(block, displacement)

    @property
    def arrays(self) -> dict[str, Any]:
        """Entries of ``kernels.levels.ForceArrays`` by name; empty for element kinds that are not supported there."""
        kinds = {OnePointBlocks: "one_point", HexahedronBlocks: "hexahedron"}
        kind = kinds.get(type(self.blocks))
        return {kind: self.blocks, "path": self.path} if kind else {}

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the energies at the displacement of the latest ``add``; the argument is not used."""
        blocks, valid = self.blocks, self.lanes.valid
        return Energy(
            strain=float(elastic_energy(blocks, self.elasticity)[valid].sum()),
            plastic=float(blocks.plastic_work[valid].sum()),
            hourglass=float(self.history["hourglass"][valid].sum()) if "hourglass" in self.history else 0.0,
        )

    def state(self, cells: NDArray[np.int64]) -> dict[str, Rows]:
        """Return the history by element for a checkpoint; ``cells`` are the global numbers of this rank's elements."""
        block, lane = np.nonzero(self.lanes.valid)
        numbers = cells[self.numbers[self.lanes.element[block, lane]]]
        return {name: Rows(numbers, self.lanes.view(values)[block, lane]) for name, values in self.history.items()}

    def restore(self, state: Mapping[str, NDArray[np.float64]]) -> None:
        """Set the history from the values that ``state`` returned, also in lanes that repeat an element."""
        block, lane = np.nonzero(self.lanes.valid)
        row = np.empty(len(self.numbers), np.int64)
        row[self.lanes.element[block, lane]] = np.arange(len(block))
        for name, values in self.history.items():
            self.lanes.view(values)[...] = state[name][row[self.lanes.element]]

    def located(self, indices: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return block and lane, each of shape (k,), of elements with ``indices (k,)`` into ``elements``."""
        block, lane = np.nonzero(self.lanes.valid)
        row = np.empty(len(self.numbers), np.int64)
        row[self.lanes.element[block, lane]] = np.arange(len(block))
        return block[row[indices]], lane[row[indices]]

    def points(self, block: NDArray[np.int64], lane: NDArray[np.int64]) -> "PointValues":
        """Return the values at the integration points of elements, with block and lane from ``located``."""
        blocks = self.blocks
        state = self.lanes.view(blocks.state)[block, lane]
        weight = self.lanes.view(blocks.weight)[blocks.pattern[block], lane, :, 0]
        work = blocks.plastic_work[block, lane] / weight.sum(axis=1)
        return PointValues(weight, state[..., :6], state[..., 6], work, self.ratios(block, lane))

    def ratios(self, block: NDArray[np.int64], lane: NDArray[np.int64]) -> NDArray[np.float64] | float:
        """Return the volume at the integration points over the undeformed one ``(k, m)``, or 1 for small strains."""
        blocks = self.blocks
        if not self.finite:
            return 1.0
        if isinstance(blocks, HexahedronBlocks):
            positions = (
                self.lanes.view(values)[row, lane]
                for values, row in ((blocks.place, block), (blocks.corners, blocks.pattern[block]))
            )
            now, rest = (gauss_volumes(position.reshape(-1, 7, 3)) for position in positions)
            return now / rest
        stretch = self.lanes.view(blocks.state)[block, lane][..., 7:13]
        return np.linalg.det(symmetric(stretch.reshape(-1, 6))).reshape(stretch.shape[:-1])

    def means(self, indices: NDArray[np.integer]) -> "Means":
        """Return volume averages of stress and plastic strain in elements with ``indices (k,)`` into ``elements``."""
        values = self.points(*self.located(indices))
        share = values.weight / values.weight.sum(axis=1)[:, None]
        stress = np.einsum("km,kmc->kc", share, values.stress)
        return Means(stress, np.einsum("km,km->k", share, values.plastic_strain), values.plastic_work)

    def frozen(self, indices: NDArray[np.integer]) -> "NonlinearElements":
        """Return an elastic copy of some elements, with the same force at the displacement of the latest ``add``.

        It does not yield, and its incompatible modes keep their amplitudes; ``take_path`` copies the history into it.
        """
        plastic = np.tile(NEVER_YIELDS, (len(self.elements.elasticity), 1))
        elastic = NonlinearElements.build(self.elements, indices.astype(np.int64), plastic, Path(self.finite, np.inf))
        if isinstance(elastic.blocks, HexahedronBlocks):
            elastic.blocks.coupling[...] *= RIGID
        return elastic

    def take_path(self, other: "NonlinearElements", block: NDArray[np.int64], lane: NDArray[np.int64]) -> None:
        """Copy the history of elements of another term; block and lane from its ``located``, in this term's order."""
        order = self.lanes.element
        for name, values in self.history.items():
            self.lanes.view(values)[...] = other.lanes.view(other.history[name])[block[order], lane[order]]

    def inverted(self, block: int, displacement: NDArray[np.float64]) -> InvertedElementError:
        """Return the error that names the worst element of a block."""
        elements, indices = self.elements, self.lanes.element[block]
        cells = elements.cells[indices]
        lowest = elements.kind.geometry((elements.points + displacement)[cells]).lowest
        worst = int(np.argmin(lowest))
        centre = ", ".join(f"{value:.6g}" for value in elements.points[cells[worst]].mean(axis=0))
        return InvertedElementError(
            f"element {self.numbers[indices[worst]]}, at first near ({centre}) m, is turned inside out (lowest Jacobian"
            f" determinant {lowest[worst]:.3e} m^3)"
        )


@dataclass(frozen=True, slots=True)
class PointValues:
    """Values at the m integration points of k elements.

    Attributes:
        weight: Volume of each integration point, shape (k, m) [m^3].
        stress: Kirchhoff stress in the corotated frame, shape (k, m, 6) [Pa].
        plastic_strain: Equivalent plastic strain, shape (k, m).
        plastic_work: Plastic work density averaged over each element, shape (k,) [J/m^3].
        ratio: Deformed over undeformed volume, shape (k, m), or 1 for small strains.
    """

    weight: NDArray[np.float64]
    stress: NDArray[np.float64]
    plastic_strain: NDArray[np.float64]
    plastic_work: NDArray[np.float64]
    ratio: NDArray[np.float64] | float

    @property
    def mises(self) -> NDArray[np.float64]:
        """Von Mises stress of the Cauchy stress, shape (k, m) [Pa]."""
        result: NDArray[np.float64] = von_mises(self.stress.reshape(-1, 6)).reshape(self.weight.shape)
        return result / self.ratio


@dataclass(frozen=True, slots=True)
class Means:
    """Volume averages over k elements.

    Attributes:
        stress: Kirchhoff stress in the corotated frame, shape (k, 6) [Pa].
        plastic_strain: Equivalent plastic strain, shape (k,).
        plastic_work: Plastic work density, shape (k,) [J/m^3].
    """

    stress: NDArray[np.float64]
    plastic_strain: NDArray[np.float64]
    plastic_work: NDArray[np.float64]


def elastic_energy(blocks: AnyBlocks, elasticity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the elastic energy s : C^-1 : s / 2 of each element of each block, shape (nb, width) [J].

    Args:
        blocks: Elements in blocks, with stresses and volumes; elements after the last one repeat it, and so
            does their energy.
        elasticity: Elasticity of each material, shape (nm, 6, 6) [Pa].
    """
    points, width = blocks.state.shape[1], blocks.cells.shape[2]
    stress = blocks.state.reshape(len(blocks.state), points, -1, width)[:, :, :6]
    strain = np.einsum("bij,bmjl->bmil", np.linalg.inv(elasticity)[blocks.material], stress, optimize=True)
    weight = blocks.weight[blocks.pattern].reshape(-1, points, width)
    return np.asarray(0.5 * np.einsum("bmil,bmil,bml->bl", stress, strain, weight, optimize=True))
