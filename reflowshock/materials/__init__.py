"""Materials: parameters, a library with sources, and constitutive laws that know no solver.

Start with ``parameters.py`` (pydantic models) and ``library.py``. ``roles.py`` assigns materials to the parts of a mesh,
``elasticity.py`` gives stiffness matrices, ``plasticity.py`` the Johnson-Cook yield stress and its radial return. A law
is a plain function of numbers: NumPy and UFL call it as it is, kernels in ``fem`` and ``particles`` compile it. Further
laws of materials, such as the kinetics of a cure or the growth of damage, belong here too: one file for each law, its
parameters in ``parameters.py``.
"""
