# make compare   run the comparison of the paper, print the table, write report and replay
# make test      run the tests
# make mutants   put faults into the package one at a time, and see whether tests notice: hours
# make benchmarks  measure how fast it is, and print a table
# make docs      build the documentation as a site, in site/
# make figures   make the figures in the documents again, by their commands; DOCUMENTS=docs/engines.md for one page
# All create .venv by themselves; a Python of 3.10 to 3.13 and a package index are enough.
PYTHON ?= python3
BIN := .venv/bin
ARGS ?=
DOCUMENTS ?= README.md $(wildcard docs/*.md)

.PHONY: compare test mutants benchmarks lint docs figures clean

compare: .venv/.installed
	$(BIN)/pronk-pin compare $(ARGS)

test: .venv/.installed-test
	$(BIN)/python -m pytest -n auto --maxprocesses 4 --dist worksteal $(ARGS)

mutants: .venv/.installed-test
	$(BIN)/python benchmarks/mutants.py $(ARGS)

benchmarks: .venv/.installed-test
	$(BIN)/python benchmarks/speed.py $(ARGS)

lint: .venv/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.github-issue-forms .github/ISSUE_TEMPLATE/[!c]*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff

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

.venv/.installed-docs: .venv/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@

.venv/.installed-dev: .venv/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

docs: .venv/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

figures: .venv/.installed-test
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m cogapp -r -I benchmarks $(DOCUMENTS)

clean:
	rm -rf .venv build dist site *.egg-info
