# Every target sets up what it needs: system libraries, .venv, the packages of requirements.txt.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
MANIFEST ?= graspe
WORKERS ?= 2
# What takes long, or needs whole recordings and trainings, is left out of `make test-fast`.
FAST := tests/test_rooms.py tests/test_architecture.py tests/graspe_data/test_*.py \
  tests/graspe_data/observation tests/graspe_data/shards tests/model_zoo/layers tests/model_zoo/models/test_*_*.py \
  tests/model_zoo/test_*.py \
  tests/planners
# What pip needs to build the package itself comes in the tested versions too.
export PIP_CONSTRAINT := $(CURDIR)/requirements.txt
export PIP_BUILD_CONSTRAINT := $(CURDIR)/requirements.txt

.PHONY: help setup system demo test test-fast docs lint format bench soak dataset field zoo export clean
.PHONY: study study-field study-train study-confirm study-trials study-tables

help:
	@echo "make demo                          raw bags to a dataset and a report, on drives it simulates"
	@echo "make test                          the whole suite"
	@echo "make dataset BAGS=... OUT=...      your own bags (MANIFEST=$(MANIFEST), WORKERS=$(WORKERS))"
	@echo "make field                         the simulated recordings that the zoo is trained on (FIELD=$(FIELD), DRIVES=$(DRIVES) a world)"
	@echo "make zoo DATA=... OUT=...         every model under one budget (RECIPE=$(RECIPE), PRESET=$(PRESET), SEEDS=$(SEEDS))"
	@echo "make study                         the examination: worlds, trainings, trials, tables (STUDY=$(STUDY))"
	@echo "make export CHECKPOINT=... OUT=... a bundle for planners (DATA=dataset tries it on real rows)"
	@echo "make test-fast | docs              the quick half of the suite; the site"
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

test-fast: setup
	$(BIN)/python -m pytest -q -n $(WORKERS) -m 'not soak and not slow' $(FAST) $(PYTEST)

docs: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.txt -e '.[docs]'
	$(BIN)/mkdocs build --strict --quiet

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

# The simulated field of the zoo: training worlds, validation worlds (seeds from 900), test scenarios.
FIELD ?= field
TRAINING := meadow woodland thicket yard mixed dusk_woodland overgrown wetland
TESTS := graspe_1_plants graspe_2_hanging_leaves graspe_3_tall_grass graspe_4_low_light \
  camera_decides lidar_decides either_decides each_is_fooled
DRIVES ?= 30
VALIDATION_DRIVES ?= 6
TEST_DRIVES ?= 16
DRIVE_S ?= 60
SENSOR_RATE ?= 1
SIMULATE = $(BIN)/graspe simulate $(1) --recordings $(2) --seed $(3) --duration $(DRIVE_S) --sensor-rate $(SENSOR_RATE) --format mcap \
  --out $(or $(4),$(FIELD))/recordings --workers $(WORKERS)

field: setup
	$(foreach name,$(TESTS),$(call SIMULATE,$(name),$(TEST_DRIVES),0) && ) true
	$(foreach name,$(TRAINING),$(call SIMULATE,$(name),$(DRIVES),0) && ) true
	$(foreach name,$(TRAINING),$(call SIMULATE,$(name),$(VALIDATION_DRIVES),900) && ) true
	$(BIN)/graspe dataset build field --recordings $(FIELD)/recordings --out $(FIELD)/dataset --workers $(WORKERS)
	$(BIN)/graspe dataset report $(FIELD)/dataset

# Every model under one budget, evaluated and compared; run again, it goes on where it stopped.
RECIPE ?= small
PRESET ?= small
SEEDS ?= 1
EVERY ?= 1
zoo: setup
	@test -n "$(DATA)" -a -n "$(OUT)" || { echo "usage: make zoo DATA=dataset OUT=folder [RECIPE=$(RECIPE) PRESET=$(PRESET) SEEDS=$(SEEDS) EVERY=$(EVERY)]"; exit 2; }
	$(BIN)/graspe zoo run --data $(DATA) --out $(OUT) --recipe $(RECIPE) --preset $(PRESET) --seeds $(SEEDS) --every $(EVERY)

# The examination, from nothing; run again, each part goes on where it stopped. What is asked, and what
# counts, is in manifests/examinations/study.yaml. Its test worlds have seeds that nothing else uses.
STUDY ?= study
STUDY_DRIVES ?= 40
STUDY_VALIDATION ?= 10
STUDY_TESTS ?= 20
STUDY_SEED ?= 2000
STUDY_SEEDS ?= 10
STUDY_TRIALS ?= 20
DECIDES := camera_decides lidar_decides either_decides each_is_fooled
FAILING := lens_covered glare lidar_sector_lost dust
DRIVEN := graspe graspe_gated graspe_no_reliability
STUDY_ZOO = $(BIN)/graspe zoo run --data $(STUDY)/dataset --condition all --every 2
study: study-field study-train study-confirm study-trials study-tables

study-field: setup
	$(foreach name,$(TESTS),$(call SIMULATE,$(name),$(STUDY_TESTS),$(STUDY_SEED),$(STUDY)) && ) true
	$(foreach name,$(TRAINING),$(call SIMULATE,$(name),$(STUDY_DRIVES),0,$(STUDY)) && ) true
	$(foreach name,$(TRAINING),$(call SIMULATE,$(name),$(STUDY_VALIDATION),900,$(STUDY)) && ) true
	$(BIN)/graspe dataset build field --recordings $(STUDY)/recordings --out $(STUDY)/dataset --workers $(WORKERS)

study-train: setup
	$(STUDY_ZOO) --preset study --recipe study --seeds $(STUDY_SEEDS) --out $(STUDY)/runs
	$(foreach of,shuffled known,$(STUDY_ZOO) --preset study --recipe study_$(of)_reliability --seeds $(STUDY_SEEDS) \
	  --model graspe --model graspe_gated --out $(STUDY)/$(of) && ) true

study-confirm: setup
	$(STUDY_ZOO) --preset small --recipe field --seeds 3 --out $(STUDY)/small

study-trials: setup
	$(foreach name,$(DRIVEN),$(BIN)/graspe export $(STUDY)/runs/$(name)-study-0/checkpoint --dataset $(STUDY)/dataset \
	  --out $(STUDY)/bundles/$(name) && ) true
	$(foreach name,$(DECIDES),$(call TRIALS,$(name)) && $(foreach of,$(FAILING),$(call TRIALS,$(name)) --condition $(of) && )) true
	$(BIN)/graspe navigate table $(STUDY)/trials

study-tables: setup
	$(BIN)/graspe zoo examine $$(ls $(STUDY)/runs/*/evaluation-*.json $(STUDY)/shuffled/*/evaluation-*.json $(STUDY)/known/*/evaluation-*.json) \
	  --examination study --out $(STUDY)/examination
	$(BIN)/graspe zoo examine $$(ls $(STUDY)/small/*/evaluation-*.json) --examination study --out $(STUDY)/examination-small

TRIALS = $(BIN)/graspe navigate run $(1) --method dwa_fox --method $(STUDY)/bundles --trials $(STUDY_TRIALS) --seed $(STUDY_SEED) \
  --workers $(WORKERS) --out $(STUDY)/trials

# A checkpoint as ONNX graphs with their contract, compared with torch before anything is written.
export: setup
	@test -n "$(CHECKPOINT)" -a -n "$(OUT)" || { echo "usage: make export CHECKPOINT=folder OUT=folder [DATA=dataset]"; exit 2; }
	$(BIN)/graspe export $(CHECKPOINT) --out $(OUT) $(if $(DATA),--dataset $(DATA))

clean:
	rm -rf $(VENV) demo build dist *.egg-info
