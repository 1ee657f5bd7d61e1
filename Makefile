# Every target sets up what it needs: system libraries, .venv, the packages of requirements.txt.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
MANIFEST ?= graspe
WORKERS ?= 2
# What pip needs to build the package itself comes in the tested versions too.
export PIP_CONSTRAINT := $(CURDIR)/requirements.txt
export PIP_BUILD_CONSTRAINT := $(CURDIR)/requirements.txt

.PHONY: help setup system demo test lint format bench soak dataset clean

help:
	@echo "make demo                          raw bags to a dataset and a report, on bags it writes itself"
	@echo "make test                          the whole suite"
	@echo "make dataset BAGS=... OUT=...      your own bags (MANIFEST=$(MANIFEST), WORKERS=$(WORKERS))"
	@echo "make lint | bench | soak           style and types | figures | the long counts"

system:
	@$(PYTHON) tools/system_libraries.py

$(STAMP): pyproject.toml requirements.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed; set PYTHON=/path/to/python3.11"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || \
	  { echo "cannot make $(VENV): apt-get install -y python3-venv"; rm -rf $(VENV); exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.txt -e '.[dev]'
	@touch $(STAMP)

setup: system $(STAMP)

demo: setup
	$(BIN)/graspe demo --out demo

test: setup
	$(BIN)/python -m pytest -n $(WORKERS) $(PYTEST)

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.txt -e '.[bench]'
	$(BIN)/python -m benchmarks --out benchmarks/results

soak: setup
	$(BIN)/python -m pytest -m soak -n $(WORKERS) $(PYTEST)

dataset: setup
	@test -n "$(BAGS)" -a -n "$(OUT)" || \
	  { echo "usage: make dataset BAGS='recording or folder ...' OUT=folder [MANIFEST=$(MANIFEST)]"; exit 2; }
	$(BIN)/graspe dataset build $(MANIFEST) $(foreach bag,$(BAGS),--recordings $(bag)) --out $(OUT) --workers $(WORKERS)
	$(BIN)/graspe dataset report $(OUT)

clean:
	rm -rf $(VENV) demo build dist *.egg-info
