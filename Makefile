# `make demo` and `make test` install what is missing first (.ci/setup); the second time that takes no time.
export OMP_NUM_THREADS = 1
# Without compiled modules every process compiles them anew: half a second each, and a run starts dozens.
unexport PYTHONDONTWRITEBYTECODE

PYTHON := .venv/bin/python
CASE := cases/jedec_bga/case.toml
# One worker more than cores: tests of schedulers and of the command line wait. A worker that dies ends the tests: replaced,
# xdist would wait for its files for ever.
PARALLEL := --numprocesses=$(shell expr $$(nproc) + 1) --maxprocesses=8 --dist=loadfile --no-loadscope-reorder --max-worker-restart=0

help:  ## this list
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 16

setup:  ## install what is missing: Debian packages, .venv
	@.ci/setup

demo: setup  ## run the default case from case file to report
	$(PYTHON) -m reflowshock run $(CASE)

test: setup  ## run every check and test, on all cores
	@.ci/setup-slurm
	@.ci/setup-browser
	$(PYTHON) -m pytest $(PARALLEL)

test-long: setup  ## the sweeps that `make test` leaves out: 50 interrupts, ..., random hard cases on three new seeds
	$(PYTHON) -m pytest -m long $(PARALLEL)
	@for seed in $$($(PYTHON) -c 'import random; print(*random.sample(range(10**6), 3))'); do echo "seed $$seed"; \
	    $(PYTHON) -m reflowshock stress-test --random 500 --seed $$seed --out runs/stress-test-$$seed || exit 1; done

test-debian13:  ## run every test on Debian 13 too, in a chroot; compare results (root)
	@.ci/debian13

test-golden: setup  ## run every case with this checkout and with the commit BASE: equal to the bit
	@[ -n "$(BASE)" ] || { echo "which commit? make test-golden BASE=COMMIT" >&2; exit 2; }
	@rm -rf build/golden && git worktree prune  # a product of earlier code with the same version would count as made
	@git worktree add --detach build/golden/base $(BASE)
	$(PYTHON) -m tests.same_results run build/golden/before --every --checkout build/golden/base
	$(PYTHON) -m tests.same_results run build/golden/after --every
	@git worktree remove --force build/golden/base
	$(PYTHON) -m tests.same_results compare build/golden/before build/golden/after --every --exactly

test-mpi: setup  ## run the tests that start several MPI ranks
	$(PYTHON) -m pytest tests/mpi

lint: setup  ## ruff, mypy, import rules
	$(PYTHON) -m pytest tests/unit/test_code.py

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
