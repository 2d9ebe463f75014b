"""Flows of a liquid by delta-SPH (`particles/sph`): a dam break, a channel, vortices. Start with `case.py`."""
