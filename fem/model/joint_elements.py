"""Nodal forces, and stress and plastic flow at the integration points, of selected elements at a sample."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.forces.force_corotational import Corotational
from reflowshock.fem.forces.force_nonlinear import NonlinearElements, PointValues
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.step_levels import levels_of
from reflowshock.fem.parallel.local_mesh import positions
from reflowshock.materials.plasticity import NEVER_YIELDS


class ElasticHexahedra:
    """Elastic elements evaluated as fully integrated hexahedra, from the initial state at every call."""

    def __init__(self, body: Body, chosen: NDArray[np.integer], finite: bool = False) -> None:
        """Select elements of a body, shape (k,), with its initial stress; ``finite`` selects finite kinematics."""
        plastic = np.tile(NEVER_YIELDS, (len(body.elements.elasticity), 1))
        elements = replace(body.elements, kind=HEXAHEDRON)
        self._term = NonlinearElements.build(elements, np.asarray(chosen), plastic, Path(finite, np.inf))
        if body.begin is not None:
            body.begin(self._term)
        self._start = {name: values.copy() for name, values in self._term.history.items()}
        self._locations = self._term.located(np.arange(len(chosen)))

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force, shape (n, 3) [N], at a displacement, shape (n, 3) [m]."""
        for name, values in self._term.history.items():
            values[...] = self._start[name]
        self._term.add(displacement, force)

    def points(self) -> PointValues:
        """Return the values at the integration points at the latest displacement."""
        return self._term.points(*self._locations)


class SampledCorotational:
    """Corotational hexahedra: force by their own law, point values by the finite-strain element."""

    def __init__(self, body: Body, term: Corotational, chosen: NDArray[np.integer]) -> None:
        """Select elements of a body, shape (k,), which belong to a corotational term."""
        self._term = term.build(body.elements, np.asarray(chosen))
        self._points = ElasticHexahedra(body, chosen, finite=True)
        self._displacement = np.zeros_like(body.local.points)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force, shape (n, 3) [N], at a displacement, shape (n, 3) [m]."""
        self._term.add(displacement, force)
        self._displacement[...] = displacement

    def points(self) -> PointValues:
        """Return the values at the integration points at the latest displacement."""
        self._points.add(self._displacement, np.zeros_like(self._displacement))
        return self._points.points()


class SampledNonlinear:
    """Path-dependent elements: point values of the body's term, forces of a copy with the selected elements."""

    def __init__(self, term: NonlinearElements, places: NDArray[np.integer]) -> None:
        """Select elements of a term by their positions in it, shape (k,)."""
        self._term, self._locations, self._frozen = term, term.located(places), term.frozen(places)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force, shape (n, 3) [N], at ``displacement``, the latest displacement of the term."""
        self._frozen.take_path(self._term, *self._locations)
        self._frozen.add(displacement, force)

    def points(self) -> PointValues:
        """Return the current values at the integration points."""
        return self._term.points(*self._locations)


class JointElements:
    """Selected elements of a rank whose nodal forces and point values are sampled.

    Elements with local time steps use the mean displacement of their substeps (``SubsteppedElements.means``), so that
    their forces are the ones that moved the body over the step.
    """

    def __init__(self, body: Body, chosen: NDArray[np.integer], level: NDArray[np.int32]) -> None:
        """Select elements of a body.

        Args:
            body: Model on this rank.
            chosen: Numbers of the selected elements, shape (k,).
            level: Step level of every element of the body, shape (ne,).
        """
        self._body, self._size = body, len(chosen)
        self._levels = levels_of(body.terms)
        is_linear = np.ones(len(chosen), dtype=bool)
        self._nonlinear: list[tuple[NDArray[np.intp], SampledNonlinear | SampledCorotational]] = []
        for term in body.terms:
            if not isinstance(term, NonlinearElements | Corotational):
                continue
            index = positions(term.numbers, chosen)
            rows = np.flatnonzero(index >= 0)
            is_linear[rows] = False
            if len(rows) and isinstance(term, NonlinearElements):
                self._nonlinear.append((rows, SampledNonlinear(term, index[rows])))
            elif len(rows) and isinstance(term, Corotational):
                self._nonlinear.append((rows, SampledCorotational(body, term, chosen[rows])))
        self._linear = [
            (k, rows, ElasticHexahedra(body, chosen[rows]))
            for k in np.unique(level[chosen])
            if len(rows := np.flatnonzero(is_linear & (level[chosen] == k)))
        ]
        plain = replace(body, begin=None)
        self._damped = None if is_linear.all() else ElasticHexahedra(plain, chosen[~is_linear])

    def forces(self, displacement: NDArray[np.float64], damping: NDArray[np.float64] | None) -> NDArray[np.float64]:
        """Return the nodal forces of the elements, shape (n, 3) [N]; collective if the body has local time steps.

        Args:
            displacement: Displacement at the latest force evaluation of the body, shape (n, 3) [m].
            damping: Velocity times beta of stiffness-proportional damping, shape (n, 3) [m], or None.
        """
        force = np.zeros_like(displacement)
        level_means = [displacement if damping is None else displacement + damping]
        for levels in self._levels:
            level_means += list(levels.means(level_means[0]))
        for values in level_means[1:]:
            self._body.tie.spread(values)
        for level, _, elements in self._linear:
            elements.add(level_means[level], force)
        for _, nonlinear in self._nonlinear:
            nonlinear.add(displacement, force)
        if damping is not None and self._damped is not None:
            self._damped.add(damping, force)
        return force

    def integrals(self, weight: NDArray[np.float64]) -> NDArray[np.float64]:
        """Integrate von Mises stress, plastic strain and plastic work density over parts of the elements.

        Args:
            weight: Volume of each part at each Gauss point of a hexahedron, shape (parts, k, 8) [m^3].

        Returns:
            Integrals at the displacement of the latest ``forces``, shape (3, parts, k) [Pa m^3, m^3, J].
        """
        result = np.zeros((3, *weight.shape[:2]))
        for rows, elements in [*((rows, item) for _, rows, item in self._linear), *self._nonlinear]:
            points, volumes = elements.points(), weight[:, rows]
            if points.weight.shape[1] == 1:
                volumes = volumes.sum(axis=2, keepdims=True)
            mises = points.mises
            work = np.broadcast_to(points.plastic_work[:, None], mises.shape)
            for k, values in enumerate((mises, points.plastic_strain, work)):
                result[k, :, rows] = np.einsum("pkm,km->kp", volumes, values)
        return result
