# Kanuka: `make render` and `make test` do everything from a fresh Debian 12 on. `make help` lists the rest.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help setup quick build wheel render manual test lint sanitize format bench bench-quick bench-setup clean

BUILD ?= build
JOBS ?= $(shell nproc)
PY := .venv/bin/python
KANUKA := .venv/bin/kanuka
SCENE ?= scenes/showcase.rib
# Sources are compiled eight at a time, the quickest from nothing. UNITY=OFF: one by one, for who changes few of them often.
UNITY ?= ON
CONFIGURE := cmake -S . -B $(BUILD) -G Ninja -DCMAKE_BUILD_TYPE=Release -DKANUKA_UNITY=$(UNITY)
EMPTY :=
export NINJA_STATUS ?= [step %f of %t, %e s] $(EMPTY)
PICTURE := out/$(basename $(notdir $(SCENE))).exr

help:           ## this list
	@sed -n 's/^\([a-z-]*\): .*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 20

setup:          ## install what is missing: Debian packages, .venv, Python packages
	@tools/setup.sh

quick: setup    ## compile what a picture needs: the Python module, without tests (Release)
	@[ -f $(BUILD)/build.ninja ] || $(CONFIGURE) -DKANUKA_TESTS=OFF
	@ninja -C $(BUILD) -j $(JOBS) kanuka_native kanuka_native_stub

build: setup    ## compile the library, the Python module and the tests (Release)
	@[ -f $(BUILD)/build.ninja ] && grep -q '^KANUKA_TESTS:BOOL=ON' $(BUILD)/CMakeCache.txt || \
	    $(CONFIGURE) -DKANUKA_TESTS=ON
	@ninja -C $(BUILD) -j $(JOBS)

wheel: setup    ## make a wheel of the package in out (compiles in build-wheel, without tests)
	@CMAKE_BUILD_PARALLEL_LEVEL=$(JOBS) $(PY) -m pip wheel . --no-deps --no-build-isolation --wheel-dir out

render: quick   ## render SCENE (the showcase) to out/*.exr and out/*.png
	@mkdir -p out
	$(KANUKA) render $(SCENE) -o $(PICTURE) --png

manual: quick   ## make the manual as a site in out/manual, with a gallery that is rendered now (minutes)
	$(PY) -m mkdocs build --strict --config-file manual/mkdocs.yml

test: build     ## all tests: C++ and Python
	@tools/run_tests.sh $(BUILD) $(JOBS)

lint: build     ## formatting, ruff, clang-tidy, layer rule
	@tools/lint.sh $(BUILD) $(JOBS)

sanitize: setup ## what reads files, and mutated input, under AddressSanitizer and UBSan (build-sanitize)
	@tools/sanitize.sh build-sanitize $(JOBS)

format: setup   ## format all C++ and Python files in place
	@git ls-files '*.cpp' '*.h' | xargs -r clang-format-19 -i
	@.venv/bin/ruff check --quiet --fix . && .venv/bin/ruff format --quiet .

bench: build    ## measure beside the renderers of bench-setup; figures go to bench/RESULTS.md
	@$(PY) bench/run.py

bench-quick: build  ## does every measure work? small pictures; figures go to out/bench
	@$(PY) bench/run.py --quick

bench-setup:    ## install those renderers into build/peers (KANUKA_PEERS), from PyPI
	@bench/setup.sh

clean:          ## remove build products and pictures; keeps .venv
	rm -rf $(BUILD) build-sanitize build-wheel out python/kanuka/_native*
