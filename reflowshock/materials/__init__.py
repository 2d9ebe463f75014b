"""Materials: parameters, a library with sources, and constitutive laws that know no solver.

Start with ``parameters.py`` (pydantic models) and ``library.py``. ``roles.py`` assigns materials to parts of a mesh.
Laws: ``elasticity.py`` (stiffness matrices), ``plasticity.py`` (Johnson-Cook yield stress and its radial return) and
``enthalpy.py`` (melting and freezing). A law is a plain function of numbers or arrays: NumPy and UFL call it as it is,
kernels in ``fem`` and ``particles`` compile it. Further laws, such as the kinetics of a cure or the growth of damage,
belong here: one file for each law, its parameters in ``parameters.py``.
"""
