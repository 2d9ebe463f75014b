"""Nonlinear elements against their NumPy twins and against the linear terms."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import SOLDER, force_of, nonlinear
from reflowshock.cases.hard.trials.boxes import KINDS, box, elements_of
from reflowshock.fem.elements.one_point import hourglass_control
from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.forces.force import force_terms, linear_terms
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.forces.nonlinear_blocks import TEN_NODES, elastic_constants
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.kernels.plasticity import yield_stress
from reflowshock.materials.library import FR4
from tests.support.fem_nonlinear import HexahedronTwin, PointTwin

LINE = np.linspace(0.0, 1.0, 4)
every_kind = pytest.mark.parametrize("name", KINDS)
both_kinematics = pytest.mark.parametrize("finite", [False, True], ids=["small", "finite"])


def distorted(name: str, material=FR4, line: np.ndarray = LINE):
    """Return elements of a cube with vertices moved by up to 0.18 of their distance."""

    def shaken(points: np.ndarray) -> np.ndarray:
        return points + 0.18 * line[1] * np.random.default_rng(5).uniform(-1, 1, points.shape)

    return elements_of(KINDS[name], *box(KINDS[name], line, line, line, move=shaken), [material])


@every_kind
@both_kinematics
def test_elastic_step_is_the_linear_force(name, finite):
    """Small kinematics are exact; with a displacement of 1e-9 finite kinematics differ by 1e-9."""
    elements, scale = distorted(name), 1e-9 if finite else 1.0
    displacement = scale * np.random.default_rng(1).uniform(-1, 1, elements.points.shape)
    (linear,) = linear_terms(elements)
    exact = force_of(linear, displacement)
    term = nonlinear(elements, FR4, finite)
    assert np.abs(force_of(term, displacement) - exact).max() < (1e-6 if finite else 1e-12) * np.abs(exact).max()
    ours, theirs = term.energy(displacement), linear.energy(displacement)
    assert ours.total == pytest.approx(theirs.total, rel=1e-6 if finite else 1e-12)
    assert ours.hourglass == pytest.approx(theirs.hourglass, rel=1e-6, abs=1e-9 * theirs.total)


def gradient_twin(elements, finite: bool, step: float, displacements: list[np.ndarray]) -> np.ndarray:
    """Return the force after the last displacement, point by point, with the derivative of the hourglass energy."""
    corners, force = elements.points[elements.cells], np.zeros_like(elements.points)
    if elements.kind.hourglass:
        geometry = elements.kind.geometry(corners)
        gradients, weights = geometry.gradient[:, None], geometry.volume[:, None]
        gamma, resistance = hourglass_control(corners, elements.elasticity, elements.material)
    else:
        kind = TEN_NODES if elements.kind.nodes == 10 else elements.kind
        gradients, determinants = kind.gradients(corners)
        weights = determinants / 6.0 / determinants.shape[1]
    for e, nodes in enumerate(elements.cells):
        for gradient, weight in zip(gradients[e], weights[e], strict=True):
            twin = PointTwin(SOLDER, elements.elasticity[0], finite, step)
            slip = np.zeros(12)
            for displacement in displacements:
                local = displacement[nodes]
                deformation = local.T @ gradient + finite * np.eye(3)
                twin.move(deformation)
                if elements.kind.hourglass:
                    amplitude = amplitudes(local, gradient, gamma[e], finite) - slip
                    slip = slip + (1.0 - carried(twin, amplitude, resistance[e], weight)) * amplitude
            force[nodes] += weight * gradient @ twin.nominal(deformation, twin.stress).T
            if elements.kind.hourglass:
                force[nodes] += slope(
                    lambda values, b=gradient, e=e, slip=slip: energy_of(
                        amplitudes(values, b, gamma[e], finite) - slip, resistance[e]
                    ),
                    local,
                )
    return force


def amplitudes(values: np.ndarray, gradient: np.ndarray, gamma: np.ndarray, finite: bool) -> np.ndarray:
    """Return the hourglass amplitudes in the corotational frame, shape (12,)."""
    left, _, right = np.linalg.svd(np.eye(3) + values.T @ gradient)
    return (gamma.T @ values @ (left @ right if finite else np.eye(3))).ravel()


def energy_of(amplitude: np.ndarray, resistance: np.ndarray) -> float:
    """Return the energy a . R a / 2 of amplitudes a with a resistance matrix R."""
    return 0.5 * amplitude @ resistance @ amplitude


def carried(twin: PointTwin, amplitude: np.ndarray, resistance: np.ndarray, volume: float) -> float:
    """Return the hourglass force of a section in addition to the stress of its centre."""
    mises = float(von_mises(twin.stress[None])[0])
    strength = max(yield_stress(twin.plastic, 0.0, twin.constants), mises)
    stress = np.sqrt(2 * SOLDER.young_modulus * energy_of(amplitude, resistance) / volume)
    return min(1.0, np.sqrt(0.75) * max(0.05, 1 - (mises / strength) ** 2) * strength / stress)


def slope(energy: Callable[[np.ndarray], float], displacement: np.ndarray) -> np.ndarray:
    """Return the derivative of an energy by differences of order four."""
    result, size = np.empty(displacement.shape), 1e-4
    for k in range(displacement.size):
        move = size * np.eye(displacement.size)[k].reshape(displacement.shape)
        near, far = (energy(displacement + s * move) - energy(displacement - s * move) for s in (1, 2))
        result.flat[k] = (8 * near - far) / (12 * size)
    return result


@pytest.mark.parametrize("name", ["one_point", "tetrahedron", "tetrahedron_quadratic"])
@both_kinematics
def test_plastic_steps_equal_their_twin(name, finite):
    elements, step = distorted(name, SOLDER, np.linspace(0.0, 1.0, 3)), 1e-6
    path = [np.random.default_rng(k).uniform(-0.05, 0.05, elements.points.shape) for k in range(3)]
    term = nonlinear(elements, SOLDER, finite, step)
    ours = [force_of(term, displacement) for displacement in path][-1]
    twin = gradient_twin(elements, finite, step, path)
    assert np.abs(ours - twin).max() < 1e-9 * np.abs(twin).max()
    assert term.energy(path[-1]).plastic > 0


@both_kinematics
def test_plastic_steps_of_the_full_hexahedron_equal_their_twin(finite):
    elements, step = distorted("incompatible_modes", SOLDER, np.linspace(0.0, 1.0, 3)), 1e-6
    path = [np.random.default_rng(k).uniform(-0.03, 0.03, elements.points.shape) for k in range(3)]
    term = nonlinear(elements, SOLDER, finite, step)
    ours = [force_of(term, displacement) for displacement in path][-1]
    twin = np.zeros_like(ours)
    for nodes in elements.cells:
        element = HexahedronTwin(elements.points[nodes], SOLDER, elements.elasticity[0], Path(finite, step))
        twin[nodes] += [element.force(displacement[nodes]) for displacement in path][-1]
    assert np.abs(ours - twin).max() < 1e-10 * np.abs(twin).max()


@every_kind
def test_restored_history_continues_to_the_same_bits(name):
    elements = distorted(name, SOLDER)
    path = [np.random.default_rng(k).uniform(-0.01, 0.01, elements.points.shape) for k in range(4)]
    first, second = (nonlinear(elements, SOLDER, True, 1e-6) for _ in range(2))
    for displacement in path[:2]:
        first.add(displacement, np.zeros_like(displacement))
    for key, values in first.history.items():
        second.history[key][...] = values
    for displacement in path[2:]:
        assert np.array_equal(force_of(first, displacement), force_of(second, displacement))
    assert first.energy(path[-1]) == second.energy(path[-1])


@pytest.mark.parametrize("name", ["one_point", "incompatible_modes"])
def test_memory_of_hexahedra_of_any_shape(name):
    term = nonlinear(distorted(name, SOLDER, np.linspace(0, 1, 13)), SOLDER, True)
    assert sum(array.nbytes for array in term.blocks) / len(term.numbers) <= 2048


def test_only_what_yields_has_a_path():
    elements = distorted("one_point")
    materials = [FR4, SOLDER]
    number = (np.arange(len(elements.cells)) % 3 == 0).astype(np.int32)
    mixed = elements_of(elements.kind, elements.points, elements.cells, materials, number)
    terms = force_terms(mixed, materials)
    (path,) = (term for term in terms if isinstance(term, NonlinearElements))
    assert np.array_equal(path.numbers, np.flatnonzero(number))
    displacement = 1e-6 * np.random.default_rng(2).uniform(-1, 1, mixed.points.shape)
    together = sum(force_of(term, displacement) for term in terms)
    (linear,) = linear_terms(mixed)
    exact = force_of(linear, displacement)
    assert np.abs(together - exact).max() < 1e-12 * np.abs(exact).max()
    (everything,) = force_terms(mixed, materials, "finite")
    assert len(everything.numbers) == len(mixed.cells)


@every_kind
def test_inverted_element_is_named(name):
    elements = distorted(name)
    displacement = np.zeros_like(elements.points)
    inner = np.argmin(np.linalg.norm(elements.points - LINE[1], axis=1))
    displacement[inner] = 0.8
    with pytest.raises(InvertedElementError, match=r"element \d+, at first near \(0\.[0-9., ]+\) m"):
        force_of(nonlinear(elements, FR4, True), displacement)


def test_material_that_couples_normal_strain_and_shear_is_refused():
    elements = distorted("one_point")
    coupled = elements.elasticity.copy()
    coupled[0, 0, 3] = coupled[0, 3, 0] = 0.1 * coupled[0, 0, 0]
    with pytest.raises(ValueError, match="couples"):
        elastic_constants(replace(elements, elasticity=coupled).elasticity)


@every_kind
def test_parts_of_one_material_share_blocks(name):
    """Joints are separate parts with few elements each; their lanes are filled nevertheless."""
    elements = distorted(name, SOLDER)
    parts = np.arange(len(elements.cells), dtype=np.int32) % 3
    of_parts = replace(elements, material=parts, elasticity=np.repeat(elements.elasticity, 3, axis=0))
    merged = nonlinear(elements, SOLDER, True)
    (many,) = force_terms(of_parts, [SOLDER, SOLDER.model_copy(), SOLDER], "finite")
    assert len(many.lanes.filled) == len(merged.lanes.filled)
    displacement = 2e-3 * np.random.default_rng(2).uniform(-1, 1, elements.points.shape)
    assert np.array_equal(force_of(many, displacement), force_of(merged, displacement))
    assert many.energy(displacement) == merged.energy(displacement)
    assert many.energy(displacement).plastic > 0.0
