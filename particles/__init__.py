"""Molten solder: ISPG particles with surface tension, wetting and gravity."""
