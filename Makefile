# dembark. `make help` lists the targets; each sets up what it needs, and does nothing twice.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
MAKEFLAGS += --no-print-directory

PROFILE ?= quick
BUILD := build
VENV := .venv
BIN := $(VENV)/bin
# The engines' Python is the system's; a newer one found first on PATH must not leak into the build.
SYSTEM_PYTHON ?= /usr/bin/python3
JOBS ?= $(shell n=$$(nproc); m=$$(awk '/MemAvailable/ {print int($$2/1048576/2)}' /proc/meminfo); echo $$(( m < 1 ? 1 : m < n ? m : n )))

TEST_JOBS ?= $(shell nproc)

sources := $(shell find plugins -name '*.hpp' -o -name '*.h' -o -name '*.cpp' -o -name 'CMakeLists.txt' | grep -v '^plugins/yade')
yade_sources := $(shell find plugins/yade -type f -not -path '*/tests/*' -not -name '*.pyc') $(shell find plugins/physics -name '*.hpp')
python_files := $(shell find plugins/python common postproc validation input_decks -type f -not -name '*.pyc' -not -path '*/tests/*')

.PHONY: all help system liggghts yade-engine yade-plugin yade test validate bench doctor figures install-liggghts clean

all: $(BUILD)/.python $(BUILD)/.liggghts $(BUILD)/.yade ## set up and build everything

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-18s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

system: ## install the system packages that are missing
	@packaging/system.sh

$(VENV)/.complete: packaging/requirements.lock | system
	@echo "dembark: making the virtual environment $(VENV)" >&2
	@$(SYSTEM_PYTHON) -m venv --clear $(VENV)
	@$(BIN)/pip install --quiet --disable-pip-version-check --use-pep517 --require-hashes --requirement packaging/requirements.lock
	@touch $@

# Everything is compiled once; the Python package is an editable install whose compiled part comes from the same headers.
$(BUILD)/.configured: CMakeLists.txt plugins/physics/CMakeLists.txt plugins/liggghts/CMakeLists.txt | $(VENV)/.complete
	@mkdir -p $(BUILD)
	@cmake -G Ninja -S . -B $(BUILD)/engines -DDEMBARK_PYTHON=OFF > $(BUILD)/configure.log || { tail -5 $(BUILD)/configure.log >&2; exit 1; }
	@touch $@

$(BUILD)/.liggghts: $(BUILD)/.configured $(sources)
	@echo "dembark: building liggghts-dembark and the tests of the headers" >&2
	@cmake --build $(BUILD)/engines -j $(JOBS) > $(BUILD)/build.log || { grep -E 'error|Error' $(BUILD)/build.log | head >&2; exit 1; }
	@mkdir -p $(BUILD)/bin && ln -sf ../engines/bin/liggghts-dembark ../engines/bin/physics-tests $(BUILD)/bin/
	@touch $@

liggghts: $(BUILD)/.liggghts ## build liggghts-dembark (build/bin/liggghts-dembark)

$(BUILD)/.python: pyproject.toml CMakeLists.txt $(python_files) $(filter plugins/physics/% plugins/python/%,$(sources)) $(VENV)/.complete
	@echo "dembark: installing the Python package into $(VENV)" >&2
	@mkdir -p $(BUILD)
	@PATH=$(CURDIR)/$(BIN):$$PATH $(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

yade-engine: | system ## find YADE, or build it once into the cache
	@packaging/yade.sh > /dev/null

$(BUILD)/.yade: $(yade_sources) packaging/yade.sh | system
	@where=$$(packaging/yade.sh) && eval "$$where" && echo "dembark: building the YADE plugin" >&2 && mkdir -p $(BUILD) && \
	 { cmake -G Ninja -S plugins/yade -B $(BUILD)/yade -DYADE_PREFIX="$$YADE_PREFIX" -DYADE_SOURCE_DIR="$$YADE_SOURCE_DIR" \
	         -DDEMBARK_OVERLAY=$(CURDIR)/$(BUILD)/yade-overlay && cmake --build $(BUILD)/yade -j $(JOBS); } > $(BUILD)/yade.log 2>&1 || \
	 { grep -E 'error|Error' $(BUILD)/yade.log | head >&2; echo "dembark: the YADE plugin did not build; see $(BUILD)/yade.log" >&2; exit 1; }
	@touch $@

yade-plugin: $(BUILD)/.yade ## build the YADE plugin and its overlay prefix (build/yade-overlay)

yade: all ## start YADE with dembark's classes (ARGS=...)
	@$(BIN)/dembark yade $(ARGS)

doctor: $(BUILD)/.python ## say what is found, what is missing and what to do
	@$(BIN)/dembark doctor

test: all ## run all tests
	@$(BUILD)/bin/physics-tests
	@$(BIN)/python -m pytest --numprocesses $(TEST_JOBS) --dist loadscope $(PYTEST_ARGS)

validate: all ## run the cases in both engines and write the report (PROFILE=quick|standard|full)
	@$(BIN)/dembark validate --profile $(PROFILE)

bench: all ## measure the styles beside the stock ones
	@$(BIN)/python -m benchmarks.run

figures: $(BUILD)/.python ## draw the figures of the documentation anew
	@$(BIN)/python docs/capillary_errors.py
	@$(BIN)/python docs/figures.py

install-liggghts: ## copy the styles into a LIGGGHTS source tree (LIGGGHTS_SRC=.../src)
	@packaging/install_liggghts.sh "$(LIGGGHTS_SRC)"

clean: ## remove what was built; results and the cached YADE stay
	@rm -rf $(BUILD) $(VENV)
