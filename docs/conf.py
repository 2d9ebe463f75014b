"""Settings of the site, which `make docs` builds. Its source is the checkout: READMEs are pages as they are."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from reflowshock import __version__ as release

project = "reflowshock"
author = "the reflowshock authors"
copyright = "the reflowshock authors, MIT licence"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "site_pages"]
root_doc = "docs/index"
include_patterns = [
    "docs/*.md", "docs/*.ipynb", "docs/tutorials/*.md", "docs/generated/*.md",
    "README.md", "ARCHITECTURE.md",
    "workflow/**README.md", "meshing/**README.md", "particles/**README.md", "fem/**README.md",
    "cases/*/README.md", "cases/measured_strip/data/README.md", "benchmarks/README.md",
]  # fmt: skip
exclude_patterns = ["docs/generated/effects.md"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}

myst_enable_extensions = ["dollarmath", "colon_fence", "linkify"]
myst_linkify_fuzzy_links = False
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_timeout = 1200  # [s] for a cell, on a machine with other work
nb_execution_raise_on_error = True

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
html_theme = "furo"
html_title = f"reflowshock {release}"
html_math_renderer = "mathml"  # by site_pages: no script of another server
html_copy_source = False
html_show_sourcelink = False
copybutton_exclude = ".linenos, .gp"
