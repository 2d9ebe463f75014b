"""Recipes for installation without `make setup` list all dependencies and existing files."""

import re
import subprocess
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
INSTALL = ROOT / "docs/install"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
ON_CONDA = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}  # named otherwise there
FROM_DEBIAN = {"fenics-dolfinx", "petsc4py", "slepc4py", "mpi4py", "openmpi", "h5py"}


def test_the_conda_environment_has_all_that_the_program_needs():
    listed = yaml.safe_load((INSTALL / "environment.yml").read_text())["dependencies"]
    flat = [requirement for entry in listed for requirement in (entry["pip"] if isinstance(entry, dict) else [entry])]
    packages = {re.split(r"[<>=]", requirement)[0]: requirement for requirement in flat}
    for dependency in PROJECT["dependencies"]:
        name, _, least = re.match(r"([\w-]+)(>=([\d.]+))?", dependency).groups()
        assert ON_CONDA.get(name, name) in packages, dependency
        if least and name != "numpy":
            assert f">={least}" in packages[ON_CONDA.get(name, name)], dependency
    assert packages.keys() >= FROM_DEBIAN


def test_the_containers_take_the_script_of_make_setup(tmp_path):
    assert (ROOT / ".ci/setup").exists()
    recipe = (INSTALL / "apptainer.def").read_text()
    post = re.search(r"%post\n(.*?)\n\n%", recipe, re.DOTALL)[1]
    commands = re.search(r"^RUN (.*?[^\\])$", (INSTALL / "Dockerfile").read_text(), re.MULTILINE | re.DOTALL)[1]
    for text in (post, commands):
        assert "/opt/reflowshock/.ci/setup" in text
        subprocess.run(["sh", "-n"], input=text, text=True, check=True)


def test_the_citation_is_that_of_this_version():
    from reflowshock import __version__

    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert cited["cff-version"] == "1.2.0"
    assert {"title", "authors", "message", "version"} <= cited.keys()
    assert str(cited["version"]) == __version__
