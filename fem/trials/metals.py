"""Metals of trials."""

from reflowshock.fem.materials.parameters import Isotropic, JohnsonCook

SOLDER = Isotropic(
    density=7400.0,
    young_modulus=50e9,
    poisson_ratio=0.36,
    plasticity=JohnsonCook(A=40e6, B=300e6, n=0.7, C=0.05, reference_rate=1.0),
)
LINEAR_HARDENING = SOLDER.model_copy(update={"plasticity": JohnsonCook(A=40e6, B=500e6, n=1.0)})
