"""Reference data of dam breaks: measured wall pressure (Buchner 2002, thesis, TU Delft) and a computed front.

Pressure: water 2 H wide and H high in a tank 5.366 H long, sensor 0.2 H above the floor; time in sqrt(H / g), pressure
in rho g H. The values were digitised from the thesis for PySPH (BSD-3), ``pysph/examples/db_exp_data.py``.
``FRONT``: a column 2 a high and a wide (a = 57.15 mm), computed by this project with interFoam of OpenFOAM 1912 for
water and air in a plane, with smooth walls, cells of a / 40 and a Courant number of 0.4. With cells of a / 20 the front
is 1.2, 1.2 and 0.9 % farther.
"""

import numpy as np

from reflowshock.arrays import Floats

WIDTH, TANK, SENSOR = 2.0, 5.366, 0.2  # in H
ALIKE = 0.01
MEASURED = (
    (0.055, 0), (0.394, 0.028), (0.466, -0.134), (0.506, -0.162), (0.553, 0.1629), (0.674, 0.0505), (0.675, -0.078),
    (0.765, -0.05), (0.844, 0.0505), (0.994, 0.0786), (1.055, -0.067), (1.113, 0.1292), (1.156, -0.134),
    (1.295, -0.078), (1.323, 0.1011), (1.525, -0.056), (1.594, 0.028), (1.835, -0.044), (1.864, 0.0168),
    (2.084, 0.0112), (2.095, -0.033), (2.244, 0.0112), (2.285, -0.028), (2.455, -0.028), (2.493, 0.1516),
    (2.494, 0.0168), (2.512, 0.258), (2.514, 0.0786), (2.59, 0.455), (2.599, 0.55), (2.611, 0.359), (2.628, 0.601),
    (2.678, 0.662), (2.728, 0.617), (2.738, 0.691), (2.828, 0.662), (2.868, 0.601), (2.968, 0.651), (2.988, 0.606),
    (3.109, 0.573), (3.249, 0.544), (3.519, 0.539), (3.649, 0.539), (3.909, 0.55), (4.009, 0.556), (4.189, 0.55),
    (4.339, 0.556), (4.509, 0.55), (4.669, 0.528), (4.869, 0.522), (5.149, 0.511), (5.319, 0.539), (5.399, 0.561),
    (5.499, 0.589), (5.648, 0.617), (5.697, 0.724), (5.708, 0.662), (5.767, 0.747), (5.777, 0.78), (5.806, 0.853),
    (5.836, 0.887), (5.917, 0.735), (5.918, 0.685), (5.928, 0.646), (5.989, 0.589), (6.089, 0.556), (6.199, 0.561),
    (6.219, 0.595), (6.308, 0.64), (6.339, 0.589), (6.349, 0.533), (6.37, 0.488), (6.46, 0.477), (6.55, 0.488),
    (6.699, 0.522), (6.749, 0.561), (6.769, 0.511), (6.8, 0.46), (6.86, 0.415), (6.97, 0.432), (7.02, 0.477),
    (7.059, 0.505), (7.1, 0.466), (7.16, 0.455), (7.21, 0.415), (7.36, 0.449),
)  # fmt: skip
# Times in sqrt(a / 2 g), and positions of the front (volume fraction 0.5) in a.
FRONT = (1.219, 1.602, 1.997), (1.725, 2.137, 2.619)


def measured_pressure(width: float, tank: float, sensor: float) -> Floats | None:
    """Return the measured pressure history at a sensor after a dam break, rows time and pressure, shape (2, k).

    Times are in sqrt(H / g), pressures in rho g H, with the height H of the column. None is returned for a geometry
    that was not measured.

    Args:
        width: Width of the column over its height.
        tank: Length of the tank over the height of the column.
        sensor: Height of the sensor over the height of the column.
    """
    ratios = np.array([width / WIDTH, tank / TANK, sensor / SENSOR])
    return np.array(MEASURED).T if (np.abs(ratios - 1.0) < ALIKE).all() else None
