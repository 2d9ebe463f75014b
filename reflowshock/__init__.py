"""From a case file to a drop-shock report; the rooms beside this file are links to those at the top of the checkout."""

from reflowshock.workflow import __version__

__all__ = ["__version__"]
