"""Stress, strain and plastic flow of watch points and fields against exact homogeneous states."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from reflowshock.cases.hard.trials.bodies import LINEAR_HARDENING, motion_of, nonlinear_body
from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.elements.stress import symmetric, von_mises
from reflowshock.fem.model.assembly import ForceOptions
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic

ELASTIC = Isotropic(density=1.0, young_modulus=1e9, poisson_ratio=0.3)
both_formulations = pytest.mark.parametrize("formulation", ["one_point", "incompatible_modes"])


def recovered(material, path, kinematics: str, formulation: str, steps: int = 100) -> tuple[StressRecovery, np.ndarray]:
    """Deform a block by path(s), s from 0 to 1, and return the recovery of two elements and the displacement."""
    points, cells = grid([0, 1, 2], [0, 1], [0, 1, 1.5])
    body, step = nonlinear_body(mesh_of(points, cells, "board", {}), material, ForceOptions(kinematics), formulation)
    motion = motion_of(body, step)
    for s in np.arange(1, steps + 1) / steps:
        motion.displacement[:] = body.local.points @ (path(s) - np.eye(3)).T
        motion.update_force()
    return StressRecovery(body, np.array([2, 0])), motion.displacement


@both_formulations
def test_cauchy_stress_and_stretch_of_a_rotating_body(formulation):
    turn, logarithm = Rotation.from_rotvec([0.5, -1.2, 0.8]), np.array([0.3, -0.1, 0.05])
    recovery, displacement = recovered(
        ELASTIC, lambda s: (turn**s).as_matrix() @ np.diag(np.exp(s * logarithm)), "finite", formulation
    )
    matrix = turn.as_matrix()
    kirchhoff = np.diag(elasticity_matrix(ELASTIC)[:3, :3] @ logarithm)
    exact = matrix @ kirchhoff @ matrix.T / np.exp(logarithm.sum())
    assert np.abs(symmetric(recovery.stress(displacement)) - exact).max() < 1e-4 * np.abs(exact).max()
    assert recovery.mises(displacement) == pytest.approx(von_mises(recovery.stress(displacement)), rel=1e-12)
    strain = recovery.strain(displacement)
    assert np.allclose(strain[:, :3], np.exp(logarithm) - 1, atol=1e-12)
    assert np.abs(strain[:, 3:]).max() < 1e-12


@both_formulations
def test_orthotropic_axes_turn_with_the_body(formulation):
    turn = Rotation.from_rotvec([0.0, 0.0, np.pi / 2])
    strain = np.array([1e-4, -2e-4, 3e-4])
    recovery, displacement = recovered(
        FR4, lambda s: (turn**s).as_matrix() @ (np.eye(3) + s * np.diag(strain)), "finite", formulation, steps=4
    )
    exact = (elasticity_matrix(FR4)[:3, :3] @ strain)[[1, 0, 2]]
    assert np.allclose(recovery.stress(displacement)[:, :3], exact, rtol=1e-3)


@both_formulations
def test_plastic_flow_of_a_stretched_bar(formulation):
    material, plastic = LINEAR_HARDENING, 0.01
    law = material.plasticity
    stress = law.A + law.B * plastic
    elastic = stress / material.young_modulus
    strain = np.diag([elastic + plastic, *[-material.poisson_ratio * elastic - plastic / 2] * 2])
    recovery, displacement = recovered(material, lambda s: np.eye(3) + s * strain, "small", formulation)
    assert np.allclose(recovery.stress(displacement), stress * np.eye(6)[0], rtol=1e-9, atol=1e-9 * stress)
    assert np.allclose(recovery.plastic_strain(), plastic, rtol=1e-9)
    assert np.allclose(recovery.plastic_work(), law.A * plastic + law.B * plastic**2 / 2, rtol=1e-3)


def test_small_kinematics_of_an_elastic_body_follow_the_linear_law():
    gradient = np.random.default_rng(1).uniform(-1e-3, 1e-3, (3, 3))
    recovery, displacement = recovered(FR4, lambda s: np.eye(3) + s * gradient, "small", "one_point", steps=1)
    strain = np.array([*np.diag(gradient), *(gradient + gradient.T)[[0, 1, 0], [1, 2, 2]]])
    assert np.allclose(recovery.stress(displacement), elasticity_matrix(FR4) @ strain, rtol=1e-10)
    assert not recovery.plastic_strain().any()


@pytest.mark.parametrize(("kinematics", "left_out"), [("small", True), ("finite", False)])
def test_neglected_strain_of_a_rotation_in_small_kinematics(kinematics, left_out):
    angle = 0.02

    def turn(s: float) -> np.ndarray:
        return Rotation.from_rotvec([s * angle, 0.0, 0.0]).as_matrix()

    recovery, displacement = recovered(LINEAR_HARDENING, turn, kinematics, "one_point", steps=1)
    exact = 1.0 - np.cos(angle)  # h = R - 1: h^T h = 2 (1 - cos) across the axis
    assert recovery.neglected_strain(displacement) == pytest.approx(exact * left_out, rel=1e-9, abs=1e-15)
