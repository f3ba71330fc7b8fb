# These commands set up .venv when it is missing. Without make: see README.md.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --no-compile -c constraints.txt

# Where this is set, each of a run's hundreds of processes would compile all that it imports anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test lint compiled docs dist figures reproduce reproduce-small clean

demo: $(VENV)/demo
	$(BIN)/evslip demo demo

test: $(VENV)/ready
	$(MAKE) --jobs 2 lint compiled
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile

lint: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports

# What samples need, compiled once: the workers that test side by side would each compile it.
compiled: $(VENV)/ready
	$(BIN)/evslip warm-up

# The documentation's site, into site/; a broken link or a missing page is an error.
docs: $(VENV)/ready
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

# Wheel and source distribution, into dist/, checked: metadata, contents, size.
dist: $(VENV)/ready
	rm -rf dist build
	$(BIN)/python -m build --outdir dist
	$(BIN)/python -m twine check --strict dist/*
	$(BIN)/python benchmarks/check_dist.py dist

# Every measured figure of the documentation, into figures/ (many hours; run it again to go on).
figures: $(VENV)/ready
	$(BIN)/python benchmarks/figures.py

# The paper's experiment, whole (many hours; run it again to go on), and every stage of it once in less than ten minutes.
reproduce: $(VENV)/ready
	$(BIN)/python experiments/reproduce.py

reproduce-small: $(VENV)/ready
	$(BIN)/python experiments/reproduce.py --small

# The demo needs less than the tests. Pip's own lines say how far it is; Python compiles a module when it is first imported.
$(VENV)/demo: pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "evslip needs Python 3.11 or newer; say make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(INSTALL) -e '.[learn,view]'
	touch $@

$(VENV)/ready: $(VENV)/demo
	$(INSTALL) -e '.[learn,control,view,dev,docs]'
	touch $@

clean:
	rm -rf $(VENV) demo build dist site reproduced-small
