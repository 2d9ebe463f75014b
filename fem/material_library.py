"""Materials by name, each constant with its source."""

from fem.material_parameters import Isotropic, Material, Orthotropic

# H tables 3-5; the shear modulus G_xz and the density are from the same widely used FR4 data set, e.g.
# Syed et al., ECTC 2005, and its successors; H leaves them out (PHYSICS 1).
FR4 = Orthotropic(
    density=1910.0,
    young_modulus_in_plane=27.924e9,
    young_modulus_out_of_plane=12.204e9,
    poisson_ratio_in_plane=0.11,
    poisson_ratio_out_of_plane=0.39,
    shear_modulus_in_plane=12.6e9,
    shear_modulus_out_of_plane=5.5e9,
)
SILICON = Isotropic(density=2330.0, young_modulus=132.46e9, poisson_ratio=0.28)
COPPER = Isotropic(density=8960.0, young_modulus=141.92e9, poisson_ratio=0.35)
SAC405 = Isotropic(density=7440.0, young_modulus=44.6e9, poisson_ratio=0.40)

LIBRARY: dict[str, Material] = {"FR4": FR4, "silicon": SILICON, "copper": COPPER, "SAC405": SAC405}
