"""Library of materials, with the source of each constant.

Comments state the scatter between sources, which is large for solder, moulding compound and plated nickel. "Not reread"
marks published constants that were not checked against the original paper: verify them before relying on them.
"""

from reflowshock.materials.parameters import Isotropic, JohnsonCook, Material, Orthotropic

# Board with its copper layers, at room temperature. H tables 3-5; the shear modulus G_xz and the density are from the
# same widely used FR4 data set, e.g. Syed et al., ECTC 2005, and its successors; H leaves them out (PHYSICS 1). The
# moduli are effective ones of board and copper: with them the board of JESD22-B111 has a first natural frequency of
# 273.5 Hz (cases/jedec_board) against about 280 Hz measured on a board with eight copper layers (Fuchs & Major,
# Frattura ed Integrita Strutturale 15, 64, 2011). They are too stiff for a laminate without copper, see below.
FR4 = Orthotropic(
    density=1910.0,
    young_modulus_in_plane=27.924e9,
    young_modulus_out_of_plane=12.204e9,
    poisson_ratio_in_plane=0.11,
    poisson_ratio_out_of_plane=0.39,
    shear_modulus_in_plane=12.6e9,
    shear_modulus_out_of_plane=5.5e9,
    thermal_expansion_in_plane=16e-6,
    thermal_expansion_out_of_plane=84e-6,
)
# Laminate without copper, at room temperature: plain epoxy fibreglass, 2.0e6 psi and Poisson's ratio 0.12 in plane
# (Steinberg, Vibration Analysis for Electronic Equipment, 3rd edition, 2000, by reading notes, not reread; he gives
# 3.0e6 psi = 20.7 GPa with several full copper planes). Other data: 21-25 GPa in plane in tables; 16.9 GPa at 25 degC
# by a line in temperature of packaging models, for which no public source was found. Assumed: across the plane the
# ratios of FR4, modulus 12.2/27.9 and G_xz 5.5/27.9 of that in plane; density, Poisson's ratio across and expansion of
# FR4; G_xy = E / (2 (1 + nu)).
FR4_LAMINATE = Orthotropic(
    density=1910.0,
    young_modulus_in_plane=13.8e9,
    young_modulus_out_of_plane=6.0e9,
    poisson_ratio_in_plane=0.12,
    poisson_ratio_out_of_plane=0.39,
    shear_modulus_in_plane=6.16e9,
    shear_modulus_out_of_plane=2.7e9,
    thermal_expansion_in_plane=16e-6,
    thermal_expansion_out_of_plane=84e-6,
)
# H table 4; the crystal has 130 GPa along <100> and 169 GPa along <110>. Its expansion rises from 2.6 to 3.6 ppm/K
# between 25 and 245 degC in tables of the crystal; H gives 2.113 for all temperatures.
SILICON = Isotropic(density=2330.0, young_modulus=132.46e9, poisson_ratio=0.28, thermal_expansion=2.113e-6)
# H table 5 as printed. Packaging handbooks give 115-131 GPa for oxygen-free and lead-frame copper (Intel Packaging
# Databook 2000, table 5-2; TopLine column grid data), 8900-8960 kg/m^3.
COPPER = Isotropic(density=8960.0, young_modulus=141.92e9, poisson_ratio=0.35, thermal_expansion=15.64e-6)
# Epoxy filled with silica: 12-18 GPa (Intel Packaging Databook 2000, chapter 5), 1800-2100 kg/m^3 (material content
# sheets of Lattice BGA packages); highly filled ones reach 20-28 GPa. Poisson ratio 0.3 as usual for filled epoxies.
# Expansion: 7-19 ppm/K in data sheets, by their filler, below the glass transition; three to four times that above it.
MOULD_COMPOUND = Isotropic(density=1950.0, young_modulus=15e9, poisson_ratio=0.30, thermal_expansion=12e-6)
# Electroplated nickel under a thin gold: E, nu, density of nickel (Reed, The Superalloys, Cambridge 2006). Electroless
# nickel with 7-9 % phosphorus is lighter and far softer: 8000-8200 kg/m^3, 50-65 GPa (MacDermid Enthone data).
# Expansion: nickel in tables of the elements.
NIAU = Isotropic(density=8908.0, young_modulus=200e9, poisson_ratio=0.31, thermal_expansion=13.4e-6)

# Sn-Ag-Cu. B, n, C: Johnson-Cook constants of Sn-3.0Ag-0.5Cu, Qin, An & Chen, J. Appl. Mech. 77, 011008 (2010),
# Hopkinson bar (not reread). A, reference rate, m: the yield stress (62 - 0.22 T) r^(0.0726 + 8.27e-5 T) MPa, T in
# degC, of Sn-3.8Ag-0.7Cu, Pang & Xiong, IEEE Trans. Compon. Packag. Technol. 28, 830 (2005) (not reread), which the law
# meets within 15 % at 25 degC and 25 % up to 125 degC, 1e-3 to 100 1/s. Other data: Ramberg-Osgood constants from
# joints in drop tests (Nguyen & Park, Microelectron. Reliab. 51, 1385, 2011), curves at 0.005-300 1/s (Wong et al.,
# Microelectron. Reliab. 67, 135, 2016).
SAC_PLASTICITY = JohnsonCook(
    A=38e6,
    B=275e6,
    n=0.71,
    C=0.0713,
    reference_rate=1e-3,
    room_temperature=298.15,
    melting_temperature=490.15,
    m=1.3,
)
# Densities: AIM data sheet (SAC305) and alloy tables (SAC405). E of Sn-Ag-Cu is 38-54 GPa in the literature, by
# ultrasound and at high rates at the upper end; nu 0.36-0.40 (0.4: NIST review of Clech, section on Poisson's ratio).
# Expansion: 20-24 ppm/K in the literature for all of these alloys; H gives none for solder.
SAC = {"thermal_expansion": 22e-6, "plasticity": SAC_PLASTICITY}
SAC305 = Isotropic(density=7380.0, young_modulus=50e9, poisson_ratio=0.36, **SAC)
SAC405 = Isotropic(density=7440.0, young_modulus=44.6e9, poisson_ratio=0.40, **SAC)
# 63Sn-37Pb. Density 8400 kg/m^3 in all tables; E 38 GPa, nu 0.39 (handbook values of ISO alloy 101; others 30 GPa);
# expansion 24-25 ppm/K.
# Plasticity: fitted here to the Anand model of 60Sn-40Pb (Wang et al., J. Appl. Mech. 68, 2001; not reread) at
# strains to 0.1, 25 to 125 degC, 1e-3 to 100 1/s: 10 % in the mean, 23 % at worst; above 0.1 1/s it extrapolates.
SNPB = Isotropic(
    density=8400.0,
    young_modulus=38e9,
    poisson_ratio=0.39,
    thermal_expansion=24.5e-6,
    plasticity=JohnsonCook(
        A=18e6,
        B=55e6,
        n=0.55,
        C=0.134,
        reference_rate=1e-3,
        room_temperature=298.15,
        melting_temperature=456.15,
        m=1.4,
    ),
)

LIBRARY: dict[str, Material] = {
    "FR4": FR4,
    "FR4_board": FR4,  # the same under the name of what it is: a board with its copper layers
    "FR4_laminate": FR4_LAMINATE,
    "copper": COPPER,
    "silicon": SILICON,
    "mould_compound": MOULD_COMPOUND,
    "NiAu": NIAU,
    "SAC305": SAC305,
    "SAC405": SAC405,
    "SAC405_elastic": SAC405.elastic,  # the elastic solder of H
    "SnPb": SNPB,
}
