# Two commands do everything on a bare machine with Python 3.11 or newer, pip and make:
#   make demo   builds .venv and runs the main job on sample_logs/ into demo_results/
#   make test   passes the tests
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
RUNTIME := $(VENV)/.runtime
DEV     := $(VENV)/.dev
SITE    := $(VENV)/.site
MYPY_NUM_WORKERS ?= 2
# Both parse every module: in one process once.
STYLE_TESTS := tests/test_architecture.py tests/test_dependencies.py
# Bytecode is kept: the tests start hundreds of processes. It comes with the first import, and only of what is imported.
PIP     := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test site robots check types style slow fuzz golden schemas bench lock newest sbom clean help

help: ## list the targets
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "groundstation needs Python 3.11 or newer: set PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "Python has no venv module: install it (Debian: apt-get install python3-venv)"; exit 1; }
	$(PYTHON) -m venv $(VENV)

# uv installs in a third of pip's time. It does not read pip's settings: pip does it where these name an index of their
# own, and where uv fails.
INSTALL = { ! $(BIN)/python -m pip config list | grep -q '\.index-url=' && $(PIP) 'uv>=0.9,<1' && \
	$(BIN)/uv pip install --quiet --python $(BIN)/python -e '$(1)'; } || $(PIP) -e '$(1)'

$(RUNTIME): pyproject.toml | $(BIN)/python
	@$(call INSTALL,.)
	@touch $@

$(DEV): pyproject.toml | $(BIN)/python
	@$(call INSTALL,.[dev])
	@touch $@ $(RUNTIME)

demo: $(RUNTIME) ## run the main job on sample_logs/ into demo_results/
	@# Exit code 3 means done with data lost, and one of the samples is damaged on purpose.
	$(BIN)/groundstation run sample_logs -o demo_results || test $$? -eq 3
	@echo "Open demo_results/<flight>/report.html, or: $(BIN)/groundstation view demo_results/<flight>"

test: $(DEV) ## the whole suite: tests and doctests
	$(BIN)/python -m pytest -q -n auto --dist worksteal

check: $(DEV) ## in half a minute: format, lint, types, the import rules between rooms
	@$(MAKE) --no-print-directory -j 2 types style

types: $(DEV)
	MYPY_NUM_WORKERS=$(MYPY_NUM_WORKERS) $(BIN)/mypy

style: $(DEV)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/python -m pytest -q $(STYLE_TESTS)

# Beside .venv: the suite sees groundstation as it is installed, without readers of others.
robots: $(DEV) ## tests of the plug-in benchmarks/recorded_robots, installed below build/
	$(PIP) --upgrade --no-deps --target build/recorded_robots ./benchmarks/recorded_robots
	PYTHONPATH=build/recorded_robots $(BIN)/python -m pytest -q benchmarks/recorded_robots/tests

$(SITE): pyproject.toml | $(BIN)/python
	@$(call INSTALL,.[site])
	@touch $@

site: $(SITE) ## the pages of docs/ and those that the code writes as a site, build/site/html; a broken link is an error
	$(BIN)/python docs/site/build.py

slow: $(DEV) ## the long Monte Carlo tests
	$(BIN)/python -m pytest -q -n auto --dist worksteal -m slow

fuzz: $(DEV) ## mutated logs through every reader for three minutes; FUZZ=10000: so many of each format
	$(BIN)/python -m tests.fuzz

golden: $(DEV) ## write anew what every plot shows, tests/references/plots.json: its diff is to be reviewed
	$(BIN)/python -m tests.plot_contents

schemas: $(DEV) ## make the package's descriptor set from schemas/*.proto, schemas/*.schema.json from the results
	$(BIN)/python -m grpc_tools.protoc -Ischemas --include_imports \
		--descriptor_set_out=groundstation/store/descriptors.binpb schemas/*.proto
	$(BIN)/python -m groundstation.pipeline.verbs.schema schemas/summary.schema.json schemas/installations.schema.json

# A peer that cannot be installed is "not measured". ROUNDS=3: quick, the table is printed and nothing published.
bench: $(RUNTIME) ## benchmarks against peers into docs/evidence/benchmarks.md; WHAT="ulog store": parts; ROUNDS=3: quick
	-$(PIP) -e '.[bench]'
	rm -f build/bench/*.json
	$(BIN)/python -m benchmarks $(WHAT)
	$(BIN)/python -m benchmarks.table $(if $(ROUNDS),--print) build/bench/*.json
	$(if $(ROUNDS),,$(BIN)/python -m benchmarks.trend build/bench/*.json)

TOOLS := build/tools
COMPILE := $(TOOLS)/bin/uv pip compile pyproject.toml --universal --python-version 3.11 --no-emit-index-url --quiet

$(TOOLS)/.made: | $(BIN)/python
	$(BIN)/python -m venv $(TOOLS)
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check 'uv>=0.9,<1' 'cyclonedx-bom>=7,<8'
	@touch $@

lock: $(TOOLS)/.made ## requirements.lock: the newest versions that the ranges and the tests allow, with hashes
	$(COMPILE) --all-extras --output-file build/everything.txt
	$(COMPILE) --constraint build/everything.txt --generate-hashes --no-annotate --upgrade \
		--custom-compile-command 'make lock' --output-file requirements.lock

newest: ## the suite against the newest versions of everything, upper limits of the ranges left out
	$(PYTHON) .ci/newest $(VENV)-newest

sbom: $(TOOLS)/.made ## dist/groundstation.cdx.json: what requirements.lock installs, with licences (CycloneDX)
	$(TOOLS)/bin/uv venv --quiet --clear --python $(BIN)/python build/locked
	$(TOOLS)/bin/uv pip install --quiet --python build/locked --require-hashes -r requirements.lock
	$(TOOLS)/bin/uv pip install --quiet --python build/locked --no-deps .
	mkdir -p dist
	$(TOOLS)/bin/cyclonedx-py environment build/locked/bin/python --pyproject pyproject.toml --output-reproducible \
		--of JSON -o dist/groundstation.cdx.json

clean: ## remove what the targets made
	rm -rf $(VENV) demo_results .mypy_cache .ruff_cache .pytest_cache build dist
