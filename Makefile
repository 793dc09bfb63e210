# make compare   run the comparison of the paper, print the table, write report and replay
# make test      run the tests
# make mutants   put faults into the package one at a time, and see whether tests notice: hours
# All create .venv by themselves; a Python of 3.10 to 3.13 and a package index are enough.
PYTHON ?= python3
BIN := .venv/bin
ARGS ?=

.PHONY: compare test mutants lint clean

compare: .venv/.installed
	$(BIN)/pronk-pin compare $(ARGS)

test: .venv/.installed-test
	$(BIN)/python -m pytest -n auto --maxprocesses 4 --dist worksteal $(ARGS)

mutants: .venv/.installed-test
	$(BIN)/python benchmarks/mutants.py $(ARGS)

lint: .venv/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

.venv/bin/python:
	@$(PYTHON) -c 'import sys; v = sys.version_info[:2]; sys.exit(0 if (3, 10) <= v <= (3, 13) else "pronk-pin needs Python 3.10 to 3.13, this is %d.%d: set PYTHON=python3.12, say" % v)'
	$(PYTHON) -m venv .venv
	@# The pip that older Pythons bring along searches for minutes before it finds a set of versions.
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade pip

.venv/.installed: .venv/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/.installed-test: .venv/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

.venv/.installed-dev: .venv/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

clean:
	rm -rf .venv build dist *.egg-info
