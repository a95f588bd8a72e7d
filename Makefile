# make lesson       set everything up and walk the guided path
# make test         set everything up, then run all checks and the tests that are quick
# make test-slow    the other tests
# make check        lint, format, layers and types only
# make bench        the speed budget, as ratios
# make fuzz         odd input for the parts that meet strangers; ends with what was tried
# make mutate       300 faults in the source: which does no test notice? (an hour)
# make help         all targets

VENV   ?= .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip install -q --disable-pip-version-check
# The first of these that exists, is new enough and can make environments. 3.11 comes
# first because PyBullet's own wheels end there; later ones take a fork's (pyproject.toml).
PYTHON ?= $(shell for p in python3.11 python3 python3.12 python3.13 python3.14; do \
	$$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
	&& { echo $$p; break; }; done)

.PHONY: help lesson test test-slow test-pythons test-newest check format hooks bench fuzz picture extras mutate reference report robots urdf traces docs notebook student-kit autograder clean

help:
	@sed -n 's/^# make /  make /p' Makefile

lesson: $(VENV)/run.stamp
	@# In a terminal it asks and waits; q ends it at any prompt.
	@# Both engines; one that cannot be had here is named in one line and left out.
	@$(BIN)/statemachine lesson
	@echo "To make statemachine a command of your shell: source $(BIN)/activate"

# worksteal: a process that has run its tests takes some of another's.
PYTEST := python -m pytest -n auto --dist worksteal

test: check
	@$(BIN)/$(PYTEST) -m "not slow"

test-slow: $(VENV)/test.stamp
	@$(BIN)/$(PYTEST) -m slow

# make test-pythons the quick tests on each of these Pythons that is installed here
PYTHONS ?= 3.11 3.12 3.13
test-pythons:
	@failed=""; for version in $(PYTHONS); do \
	found=""; for python in python$$version "$$(uv python find $$version 2>/dev/null)" \
	"$$(pyenv prefix $$version 2>/dev/null)/bin/python"; do \
	"$$python" -c "import sys, venv, ensurepip; sys.exit('%d.%d' % sys.version_info[:2] != '$$version')" \
	2>/dev/null && { found="$$python"; break; }; done; \
	test -n "$$found" || { echo "Python $$version is not installed here: left out"; continue; }; \
	echo "Python $$version: $$found"; \
	{ make --no-print-directory VENV=.venv-$$version PYTHON="$$found" .venv-$$version/test.stamp \
	&& .venv-$$version/bin/$(PYTEST) -m "not slow"; } || failed="$$failed $$version"; \
	done; test -z "$$failed" || { echo "failed on Python$$failed"; exit 1; }

# make test-newest  all tests with the newest versions that pyproject.toml allows
test-newest:
	@rm -f .venv-newest/*.stamp
	@$(MAKE) --no-print-directory VENV=.venv-newest CONSTRAINTS="-U --upgrade-strategy eager" \
	.venv-newest/test.stamp
	@.venv-newest/bin/$(PYTEST)

check: $(VENV)/test.stamp
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/lint-imports
	@$(BIN)/pyright --pythonpath $(BIN)/python --threads 2
	@$(BIN)/python tools/clear.py
	@$(BIN)/python tools/check_templates.py
	@$(BIN)/check-jsonschema -q --builtin-schema vendor.github-workflows .github/workflows/*.yml docs/upgrade.yml
	@$(BIN)/check-jsonschema -q --builtin-schema vendor.github-issue-forms .github/ISSUE_TEMPLATE/[!c]*.yml
	@$(BIN)/check-jsonschema -q --builtin-schema vendor.citation-file-format CITATION.cff

# make format       put the sources into the project's format
format: $(VENV)/test.stamp
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

# make hooks        let git run the checks before a commit and a push
hooks: $(VENV)/test.stamp
	@$(BIN)/pre-commit install --hook-type pre-commit --hook-type pre-push

bench: $(VENV)/bench.stamp
	@STATEMACHINE_ENGINES=$(VENV)/engines $(BIN)/python -m tools.benchmarks

fuzz: $(VENV)/test.stamp
	@$(BIN)/python -m tools.fuzz --seed $(SEED) --times $(TIMES)

mutate: $(VENV)/test.stamp
	@$(BIN)/python -m tools.mutants

# make reference    which figure is another than before the house became smaller?
reference: $(VENV)/test.stamp
	@$(BIN)/python -m tools.reference compare

# make picture      render models/so101/so101.png anew (needs EGL or OSMesa)
picture: $(VENV)/test.stamp
	@$(BIN)/python models/so101/render.py

# make urdf         write models/so101/so101.urdf anew from so101.xml
urdf: $(VENV)/run.stamp
	@$(BIN)/python models/so101/make_urdf.py

# make extras       what figures, films, the viewer, sweeps and parquet need, too
extras: $(VENV)/run.stamp
	@echo "adding figures, films, the viewer, sweeps and parquet: about half a minute ..."
	@$(PIP) $(CONSTRAINTS) -e '.[plot,render,view,sweep,parquet]'

# make report       where the engines part when the arm is told one pose, and why: hold.html
report: $(VENV)/report.stamp
	@# 1: they differ, which is what the page is about.
	@$(BIN)/statemachine compare hold --html hold.html >/dev/null || [ $$? -eq 1 ]
	@echo "hold.html: open it in a browser"

# make robots       a table of the models in DIR: what each does on every engine (DIR=models)
DIR ?= models
robots: $(VENV)/run.stamp
	@$(BIN)/statemachine robots $(DIR)

# make traces       record anew what the package brings of engines that may not be here
traces: $(VENV)/run.stamp
	@STATEMACHINE_ENGINES=$(VENV)/engines $(BIN)/python models/so101/make_traces.py

# make docs         the path as pages, made from runs: docs/_build/html/index.html
docs: $(VENV)/test.stamp
	@echo "running every lesson on every engine that is here, and asking the engines:" \
	"about 4 minutes on two idle cores ..."
	@$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

# make notebook     write notebooks/path.ipynb anew from the lessons
notebook: $(VENV)/test.stamp
	@$(BIN)/python notebooks/make_notebook.py

# make student-kit  a zip for students, without solutions: dist/statemachine-student-kit.zip
# make autograder   a zip for Gradescope: dist/statemachine-autograder.zip
student-kit autograder: $(VENV)/run.stamp
	@$(BIN)/python teaching/make_kits.py $@

# make clean        remove what the others made
clean:
	rm -rf .venv .venv-newest .venv-3.* build dist docs/_build docs/path docs/reference docs/comparisons .pytest_cache .ruff_cache .hypothesis

CONSTRAINTS ?= -c constraints.txt
# Of make fuzz: what is drawn, and how many times as much.
SEED    ?= 0
TIMES   ?= 1

$(VENV)/run.stamp: pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "no Python 3.11 or newer with venv and ensurepip here" \
	"(Debian, Ubuntu: apt-get install python3-venv)"; exit 1; }
	@echo "setting up $(VENV) with $(PYTHON): about a minute the first time ..."
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(PIP) $(CONSTRAINTS) -e '.[faults]'
	@touch $@

$(VENV)/bench.stamp: $(VENV)/run.stamp
	@echo "adding what the speed budget needs ..."
	@$(PIP) $(CONSTRAINTS) -e '.[gym]'
	@touch $@

$(VENV)/report.stamp: $(VENV)/run.stamp
	@echo "adding what the charts of a page need ..."
	@$(PIP) $(CONSTRAINTS) -e '.[plot]'
	@touch $@

$(VENV)/test.stamp: $(VENV)/run.stamp
	@echo "adding what tests and checks need ..."
	@$(PIP) $(CONSTRAINTS) -e '.[test,check,render]'
	@touch $@
