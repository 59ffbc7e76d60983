# make demo   run the example protocol on the virtual bench
# make test   run the first tier of tests, on all cores
# make test-all  run both tiers: statistics at full draws, 100 kills, the first hour, every command
#             of the documentation, wheel, benchmarks' own tests; up to an hour
# make check  ruff, format, pyright, import-linter
# make wheel  install the wheel with an extra outside the clone, and use it there
# make feedback  time tests, CI and commands beside their bars
# make site   build/site: these pages and those of each room's names, to be searched without a network
# make bench  time the twin, print its ground law beside references, the thesis' results beside ours, measure cleaning and reading,
#             kill clients and print how long their outputs stayed on
# make bank   draw hidden-effect cases with SEED, diagnose them, write docs/reference/bank.md
# make fuzz   feed the reader of exports 100,000 changed files
# make schemas / effects / supplies / pictures   write docs/reference and the pictures of docs/
PYTHON ?= python3
# one worker more than cores, as some tests mostly wait: for leases, time-outs, killed processes
WORKERS = $(shell expr `$(PYTHON) -c 'import os; print(os.cpu_count())'` + 1)
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist loadgroup --no-loadscope-reorder
BIN := .venv/bin
INSTALLED := .venv/installed

# Compiled modules are kept: the tests start hundreds of processes, each of which would compile anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: install demo test test-all check site wheel feedback bench bank fuzz schemas effects supplies pictures clean

install: $(INSTALLED)

$(INSTALLED): pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
	$(BIN)/python -m workbench.sim
	$(BIN)/python -m workbench.tracking
	touch $@

demo: install
	$(BIN)/workbench run protocols/hop-17.yaml --bench virtual

test: install
	$(PYTEST)

test-all: install
	$(PYTEST) -m "long or not long"

check: install
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

site: install
	$(BIN)/sphinx-build --quiet --fail-on-warning --fresh-env -c docs -d build/doctrees . build/site

wheel: install
	.ci/wheel

feedback: install
	$(BIN)/python benchmarks/feedback.py

bench: install
	$(BIN)/python benchmarks/twin.py
	$(BIN)/python benchmarks/integrators.py
	$(BIN)/python -m benchmarks.contact
	$(BIN)/python benchmarks/thesis.py
	$(BIN)/python benchmarks/cleaning.py
	$(BIN)/python benchmarks/tracking.py
	$(BIN)/python benchmarks/calibrate.py
	$(BIN)/python benchmarks/fit.py
	$(BIN)/python benchmarks/identify.py
	$(BIN)/python benchmarks/replay.py
	$(BIN)/python -m benchmarks.kills
	$(BIN)/python benchmarks/search.py
	$(BIN)/python benchmarks/optimize.py --only speed
	$(BIN)/python benchmarks/wire.py
	$(BIN)/python benchmarks/photo.py
	$(BIN)/python benchmarks/catalogue.py
	$(BIN)/python -m benchmarks.live
	$(BIN)/python benchmarks/film.py

SEED ?= 1
CASES ?= 40

bank: install
	$(BIN)/python -m benchmarks.bank --seed $(SEED) --cases $(CASES)

fuzz: install
	$(BIN)/python tests/tracking/fuzzing.py

schemas: install
	for name in protocol part bench sheet model shape calibration rig; do \
	  $(BIN)/workbench schema $$name > docs/reference/schemas/$$name-1.json; \
	done

effects: install
	$(BIN)/python docs/make_effects.py docs/reference/effects.md

supplies: install
	$(BIN)/python docs/make_supplies.py docs/reference/supplies.md

pictures: install
	rm -rf build/pictures
	$(BIN)/workbench run protocols/hop-17.yaml --runs build/pictures
	$(BIN)/python docs/make_pictures.py build/pictures/* docs/pictures
	WORKBENCH_PICTURES=docs/pictures $(BIN)/python -m pytest -q tests/report/test_review_bar.py
	$(BIN)/python docs/make_template_picture.py docs/pictures
	$(BIN)/python docs/make_output_picture.py docs/pictures
	$(BIN)/python docs/make_architecture_picture.py docs/pictures
	$(BIN)/python -m docs.make_panel_picture docs/pictures

clean:
	rm -rf .venv build dist .pytest_cache .ruff_cache .hypothesis
