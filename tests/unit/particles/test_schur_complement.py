"""Schur complement of the pressure equation against the dense matrix."""

import numpy as np
from scipy import sparse

from reflowshock.particles.discretisation.effective_mass import EffectiveMass
from reflowshock.particles.discretisation.schur_complement import LowRank, SchurComplement, VolumeRateRows

COUNT, MOVED, TIME_STEP = 6, 4, 0.3  # particles, surface particles


def test_schur_complement_is_the_dense_matrix():
    random = np.random.default_rng(4)
    masses = np.repeat(random.uniform(1.0, 2.0, COUNT), 3)
    root = random.normal(size=(3 * MOVED, 3 * MOVED))
    stiffness = np.zeros((3 * COUNT, 3 * COUNT))
    stiffness[: 3 * MOVED, : 3 * MOVED] = root @ root.T
    rigid = np.linalg.qr(random.normal(size=(3 * COUNT, 2)))[0].T / np.sqrt(masses)
    within = np.eye(3 * COUNT) - rigid.T @ (rigid * masses)
    inertia = np.diag(masses) / TIME_STEP + TIME_STEP * within.T @ stiffness @ within
    pairs = sparse.random(COUNT, COUNT, 0.6, "csr", random_state=1)
    entries = random.normal(size=(pairs.nnz, 3))
    rates = np.zeros((COUNT, COUNT, 3))
    rates[pairs.nonzero()] = entries
    shares, gradient = random.uniform(size=COUNT), random.normal(size=(COUNT, 3))
    columns, core = random.normal(size=(COUNT, 2)), np.diag([1.0, -0.5])
    rows = rates.reshape(COUNT, -1) + np.outer(shares, gradient)
    expected = rows @ np.linalg.solve(inertia, rows.T) + columns @ core @ columns.T

    surface = sparse.bsr_matrix(stiffness[: 3 * MOVED, : 3 * MOVED], blocksize=(3, 3))
    operator = SchurComplement.of(
        VolumeRateRows(pairs.indptr.astype(np.int64), pairs.indices, entries),
        shares,
        gradient,
        EffectiveMass.of(masses, surface, rigid, TIME_STEP),
        LowRank(columns, core),
    )
    pressures = random.normal(size=COUNT)
    np.testing.assert_allclose(operator(pressures), expected @ pressures, rtol=1e-10)
