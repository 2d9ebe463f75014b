# `make demo` and `make test` first install missing packages (.ci/setup); if none is missing this takes no time.
export OMP_NUM_THREADS = 1
# Without compiled modules each of the dozens of processes of a run would compile them, half a second each.
unexport PYTHONDONTWRITEBYTECODE

PYTHON := .venv/bin/python
CASE := cases/jedec_bga/case.toml
# One worker more than cores, since tests of schedulers and of the command line wait. A worker that dies ends the tests:
# with a replacement xdist would wait forever for its files.
PARALLEL := --numprocesses=$(shell expr $$(nproc) + 1) --maxprocesses=8 --dist=loadfile --no-loadscope-reorder --max-worker-restart=0

help:  ## list the targets
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 16

setup:  ## install missing Debian packages and the virtual environment
	@.ci/setup

demo: setup  ## run the default case from case file to report
	$(PYTHON) -m reflowshock run $(CASE)

test: setup  ## run all checks and tests on all cores
	@.ci/setup-slurm
	@.ci/setup-browser
	$(PYTHON) -m pytest $(PARALLEL)

test-long: setup  ## run the long tests: 50 interrupts, sweeps, random hard cases with three new seeds
	$(PYTHON) -m pytest -m long $(PARALLEL)
	@for seed in $$($(PYTHON) -c 'import random; print(*random.sample(range(10**6), 3))'); do echo "seed $$seed"; \
	    $(PYTHON) -m reflowshock stress-test --random 500 --seed $$seed --out runs/stress-test-$$seed || exit 1; done

test-debian13:  ## run all tests on Debian 13 in a chroot and compare results (root)
	@.ci/debian13

test-golden: setup  ## run all cases with this checkout and the commit BASE; results must be equal to the bit
	@[ -n "$(BASE)" ] || { echo "BASE is missing; run make test-golden BASE=COMMIT" >&2; exit 2; }
	@rm -rf build/golden && git worktree prune  # products of earlier code with the same version would count as valid
	@git worktree add --detach build/golden/base $(BASE)
	$(PYTHON) -m tests.same_results run build/golden/before --every --checkout build/golden/base
	$(PYTHON) -m tests.same_results run build/golden/after --every
	@git worktree remove --force build/golden/base
	$(PYTHON) -m tests.same_results compare build/golden/before build/golden/after --every --exactly

test-mpi: setup  ## run the tests that start several MPI ranks
	$(PYTHON) -m pytest tests/mpi

lint: setup  ## ruff, mypy, import rules, wording
	$(PYTHON) -m pytest tests/unit/test_code.py tests/unit/test_writing.py

docs: setup  ## build the site: build/docs/html/index.html
	@$(PYTHON) -c 'import furo, myst_nb, sphinx_copybutton' 2>/dev/null || \
	    $(PYTHON) -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --no-build-isolation --editable '.[docs]'
	$(PYTHON) -m sphinx --fail-on-warning --keep-going --quiet -c docs -d build/docs/doctrees . build/docs/html

bench: export PYTHONPATH = $(CURDIR)
bench: setup  ## run the benchmarks; JSON in benchmarks/results
	@for script in benchmarks/*.py; do [ -e "$$script" ] || continue; echo "$$script"; $(PYTHON) "$$script" || exit 1; done

clean:  ## remove runs and caches (keeps .venv)
	rm -rf runs build docs/generated *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +

.PHONY: help setup demo test test-long test-debian13 test-golden test-mpi lint docs bench clean
.DEFAULT_GOAL := help
