"""Flows of a liquid by delta-SPH (`particles/sph`): dam break, channel, vortices, droplets. Start with `case.py`."""
