# Everything runs in .venv, which is made here when missing and never upgraded behind your back.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/pip install -qq --disable-pip-version-check
# What the build needs is installed once, so that a rebuild after an edit compiles only what changed.
BUILD_TOOLS := "scikit-build-core>=0.10" "nanobind==2.14.0" cmake ninja
NATIVE := $(wildcard codec/* codec/*/*)
PLUGIN := $(wildcard mitsuba_plugin/src/*) mitsuba_plugin/CMakeLists.txt mitsuba_plugin/build.py
NODE_MODULES := build/node

.PHONY: help demo test test-full fuzz shaders bench figures clean

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

demo: .venv/installed .venv/mitsuba  ## compress, decompress and verify a generated model; table and pictures in demo-output
	@$(BIN)/gltf-meshlet demo

test: .venv/installed .venv/mitsuba .venv/extras  ## all tests on generated and small real models
	@$(BIN)/python -m pytest -q --junitxml=build/test-results.xml $(PYTEST_ARGS)

test-full: .venv/installed .venv/mitsuba .venv/extras  ## all tests on all models; fails without them or the renderers
	@$(BIN)/python -m pytest -q --full --junitxml=build/test-results.xml $(PYTEST_ARGS)

fuzz: .venv/installed  ## 100,000 mutations of compressed buffers through the decoder under ASan and UBSan
	@folder=$$(CXX=$${CXX:-$$(command -v clang++ || command -v g++)} $(BIN)/python -m tools.native_build MESHLET_FUZZ) \
	  && for program in $(basename $(notdir $(wildcard codec/fuzz/*.cpp))); do $$folder/$$program spec/vectors || exit 1; done

shaders: .venv/installed  ## vk_backend/spirv from shaders/, after an edit there (needs glslangValidator)
	@$(BIN)/python -m vk_backend.build_shaders

# What a GPU is needed for is apart: docs/vulkan.md, docs/vulkan-raytracing.md.
bench: .venv/installed .venv/mitsuba .venv/extras .venv/bench  ## all measurements on the CPU, docs/results.md and its pages (about an hour)
	@for question in size paper table1 speed quality parameters choices mitsuba figures how_it_works results_page; do \
	  $(BIN)/python -m bench $$question || exit 1; done

figures: .venv/installed .venv/mitsuba  ## the pictures of the demo that README.md shows
	@$(BIN)/gltf-meshlet demo build/demo && cp build/demo/meshlets.png build/demo/comparison.png build/demo/size.png build/demo/render_comparison.png docs/

clean:  ## remove everything that make made
	rm -rf .venv build demo-output mitsuba_plugin/plugins

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' && $(PYTHON) -m venv .venv \
	  || { rm -rf .venv; echo "make: cannot create .venv; needs Python 3.10 or newer with its venv module (Debian: apt install python3-venv)"; exit 1; }

# An editable install: Python edits count at once, C++ edits through this rule.
.venv/installed: .venv/bin/python pyproject.toml CMakeLists.txt $(NATIVE)
	@echo "installing into .venv"
	@$(PIP) $(BUILD_TOOLS) && $(PIP) --no-build-isolation --editable ".[test]" \
	  || { echo "make: cannot install the project; it needs a C++17 compiler (Debian: apt install g++) and a Python package index"; exit 1; }
	@touch $@

# Mitsuba and the plugin for it. Everything else works without, so that a failure here is one line.
.venv/mitsuba: .venv/installed $(NATIVE) $(PLUGIN)
	@$(PIP) "gltf-meshlet[mitsuba]" 2>/dev/null || echo "make: mitsuba cannot be installed; nothing is rendered with it"
	@test -d mitsuba_plugin/plugins || echo "building the Mitsuba plugin (a minute)"
	@$(BIN)/python mitsuba_plugin/build.py build/mitsuba || echo "make: nothing is rendered with Mitsuba"
	@touch $@

# What only some tests need: without it they are skipped, with their reason.
.venv/extras: tools/system_packages.py | .venv/installed
	@$(PIP) "gltf-meshlet[draco]" 2>/dev/null || echo "make: DracoPy cannot be installed; tests on Draco input are skipped"
	@$(PIP) "gltf-meshlet[vulkan]" 2>/dev/null || echo "make: the Python package vulkan cannot be installed; tests of the Vulkan renderer are skipped"
	@npm install --silent --no-audit --no-fund --prefix $(NODE_MODULES) gltf-validator@2.0.0-dev.3.10 gltfpack@1.3.0 >/dev/null 2>&1 \
	  || echo "make: the npm packages gltf-validator and gltfpack cannot be installed; tests with them are skipped"
	@$(BIN)/python tools/system_packages.py
	@touch $@

# The peers that the measurements run.
.venv/bench: .venv/installed
	@$(PIP) "gltf-meshlet[bench]" 2>/dev/null || echo "make: scipy, DracoPy or meshoptimizer cannot be installed; their columns stay empty"
	@touch $@
