"""What some elements do at a sample: forces at their nodes, stress and flow at their integration points."""

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
    """Elastic elements, computed anew from rest as elements with points: the same element in either formulation."""

    def __init__(self, body: Body, chosen: NDArray[np.integer], finite: bool = False) -> None:
        """Take elements ``chosen (k,)`` of a body with the stress in which it begins; ``finite`` ones turn."""
        plastic = np.tile(NEVER_YIELDS, (len(body.elements.elasticity), 1))
        elements = replace(body.elements, kind=HEXAHEDRON)
        self._term = NonlinearElements.build(elements, np.asarray(chosen), plastic, Path(finite, np.inf))
        if body.begin is not None:
            body.begin(self._term)
        self._start = {name: values.copy() for name, values in self._term.history.items()}
        self._place = self._term.located(np.arange(len(chosen)))

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m]."""
        for name, values in self._term.history.items():
            values[...] = self._start[name]
        self._term.add(displacement, force)

    def points(self) -> PointValues:
        """Return the values at the points at the latest displacement."""
        return self._term.points(*self._place)


class TurningElements:
    """Hexahedra that turn and strain little: their own force; points as elements with finite strains have them."""

    def __init__(self, body: Body, term: Corotational, chosen: NDArray[np.integer]) -> None:
        """Take elements ``chosen (k,)`` of a body, some of those of a term."""
        self._own = term.build(body.elements, np.asarray(chosen))
        self._points = ElasticHexahedra(body, chosen, finite=True)
        self._displacement = np.zeros_like(body.local.points)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m]."""
        self._own.add(displacement, force)
        self._displacement[...] = displacement

    def points(self) -> PointValues:
        """Return the values at the points at the latest displacement."""
        self._points.add(self._displacement, np.zeros_like(self._displacement))
        return self._points.points()


class FollowingElements:
    """Elements with a path, as the body's own term has them; a copy of those in question tells their forces."""

    def __init__(self, term: NonlinearElements, places: NDArray[np.integer]) -> None:
        """Take elements at ``places (k,)`` among those of a term."""
        self._own, self._place, self._frozen = term, term.located(places), term.frozen(places)

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force ``(n, 3)`` [N] that the term had at its latest displacement, which is given."""
        self._frozen.take_path(self._own, *self._place)
        self._frozen.add(displacement, force)

    def points(self) -> PointValues:
        """Return the values at the points now."""
        return self._own.points(*self._place)


class JointElements:
    """Elements of a rank whose forces and points are asked for at samples.

    Elements in levels feel the mean of their substeps (``SubsteppedElements.means``), so that their forces are those
    that moved the body over the step.
    """

    def __init__(self, body: Body, chosen: NDArray[np.integer], level: NDArray[np.int32]) -> None:
        """Take elements ``chosen (k,)`` of a body; ``level (ne,)`` of all its elements."""
        self._body, self._size = body, len(chosen)
        self._levels = levels_of(body.terms)
        left = np.ones(len(chosen), dtype=bool)
        self._nonlinear: list[tuple[NDArray[np.intp], FollowingElements | TurningElements]] = []
        for term in body.terms:
            if not isinstance(term, NonlinearElements | Corotational):
                continue
            place = positions(term.numbers, chosen)
            rows = np.flatnonzero(place >= 0)
            left[rows] = False
            if len(rows) and isinstance(term, NonlinearElements):
                self._nonlinear.append((rows, FollowingElements(term, place[rows])))
            elif len(rows) and isinstance(term, Corotational):
                self._nonlinear.append((rows, TurningElements(body, term, chosen[rows])))
        self._linear = [
            (k, rows, ElasticHexahedra(body, chosen[rows]))
            for k in np.unique(level[chosen])
            if len(rows := np.flatnonzero(left & (level[chosen] == k)))
        ]
        plain = replace(body, begin=None)
        self._damped = None if left.all() else ElasticHexahedra(plain, chosen[~left])

    def forces(self, displacement: NDArray[np.float64], damping: NDArray[np.float64] | None) -> NDArray[np.float64]:
        """Return what the elements' nodes are pulled by ``(n, 3)`` [N]; collective where a body has levels.

        Args:
            displacement: ``(n, 3)`` [m], that of the latest forces of the body.
            damping: ``(n, 3)`` [m] velocity times beta of stiffness-proportional damping, None without.
        """
        force = np.zeros_like(displacement)
        felt = [displacement if damping is None else displacement + damping]
        for levels in self._levels:
            felt += list(levels.means(felt[0]))
        for values in felt[1:]:
            self._body.tie.spread(values)
        for level, _, elements in self._linear:
            elements.add(felt[level], force)
        for _, nonlinear in self._nonlinear:
            nonlinear.add(displacement, force)
        if damping is not None and self._damped is not None:
            self._damped.add(damping, force)
        return force

    def integrals(self, weight: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return integrals of von Mises stress [Pa], plastic strain and work density [J/m^3] over parts of elements.

        Args:
            weight: ``(parts, k, 8)`` [m^3] volume of each part at each Gauss point of a hexahedron.

        Returns:
            ``(3, parts, k)``, at the displacement of the latest ``forces``.
        """
        result = np.zeros((3, *weight.shape[:2]))
        for rows, elements in [*((rows, item) for _, rows, item in self._linear), *self._nonlinear]:
            found, own = elements.points(), weight[:, rows]
            if found.weight.shape[1] == 1:
                own = own.sum(axis=2, keepdims=True)
            mises = found.mises
            work = np.broadcast_to(found.plastic_work[:, None], mises.shape)
            for k, values in enumerate((mises, found.plastic_strain, work)):
                result[k, :, rows] = np.einsum("pkm,km->kp", own, values)
        return result
