"""Molten solder by particles: the shape of joints and drops at rest, and their motion.

The default reflow solver relaxes the energy of the tracked surface at constant volume (``steps/relaxation.py``); the
particles inside follow a potential flow. The ISPG scheme of the paper (``gripc/gripc_step.py``) can be selected for
comparison. Start with ``scenes/reflow.py``.
"""

from reflowshock.kernel_cache import install_locator

install_locator()
