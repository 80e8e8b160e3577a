# Everything runs in .venv. A step that is done leaves an empty file there (a stamp) and runs again
# only if something it depends on is newer.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/pip install -qq --disable-pip-version-check
# Installed once, so that a rebuild after an edit compiles only what changed.
BUILD_TOOLS := "scikit-build-core>=0.10" "hatch-fancy-pypi-readme" cmake ninja
NODE_PACKAGES := gltf-validator@2.0.0-dev.3.10 gltfpack@1.3.0
NODE_MODULES := build/node
# Exact version, as with ruff: another one formats or complains differently. biome.json names it too.
BIOME_PACKAGE := @biomejs/biome@2.6.8
BIOME := $(NODE_MODULES)/node_modules/.bin/biome
BROWSER_PACKAGES := playwright-core@1.65.1 esbuild@0.28.2
# Engines with their types, for the plugins' tests in Node and in browsers; WebGPU in Node, and what
# drives Firefox.
WEB_PACKAGES := typescript@7.0.2 @types/three@0.187.0 @gltf-transform/core@4.5.1 \
  @gltf-transform/extensions@4.5.1 @gltf-transform/cli@4.5.1 \
  three@0.187.0 @babylonjs/core@9.28.0 @babylonjs/loaders@9.28.0 \
  webgpu@0.6.2 puppeteer-core@25.16.0
BENCH_PACKAGES := draco3d@1.5.9 meshoptimizer@1.3.0
DEMO_MODEL := mkdir -p build && $(BIN)/python -c "from gltf_meshlet.demo import model; \
  model.write_glb(model.generate(), 'build/demo.glb'); print('build/demo.glb')"
# A file for each of three of its primitives.
GALLERY_MODELS := $(BIN)/python -c "from gltf_meshlet.demo import model; \
  made = {f'build/{one.name}.glb': one for one in model.generate()[:3]}; \
  [model.write_glb([one], path) for path, one in made.items()]; print(*made)"
BPY := bpy==5.0.1
WEB := tools/build_wasm.py $(wildcard web/*.cpp web/heap.h codec/format/* codec/decode/* codec/transport/*)
NATIVE := CMakeLists.txt $(wildcard cmake/*implifier* codec/* codec/*/*)
PLUGIN := mitsuba_plugin/build.py mitsuba_plugin/CMakeLists.txt $(wildcard mitsuba_plugin/src/*)
# A process per core; a file of tests stays in one process, which compiles its shaders once.
PYTEST := $(BIN)/python -m pytest -q -n auto --dist loadfile --junitxml=build/test-results.xml
MEASUREMENTS := meshlet_formats size paper table1 speed quality parameters choices mitsuba \
  lod figures overview
PICTURES := meshlets render_comparison
VERSION = $(shell sed -n 's/^__version__ = "\(.*\)"/\1/p' gltf_ext/__init__.py)
# Of make fuzz: how many, and which.
MUTANTS := 100000
SEED := 1

.PHONY: help demo test test-full test-web test-platforms lint format lines fuzz shaders wgsl bench figures docs wheel blender amalgamation shader-package packages web hooks clean

help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

demo: .venv/installed .venv/mitsuba  ## compress, verify and render a generated model; results in demo-output
	@$(BIN)/gltf-meshlet demo

test: lint .venv/installed .venv/mitsuba .venv/extras .venv/web  ## lint, then all tests on generated and small real models
	@$(PYTEST) $(PYTEST_ARGS)

test-full: lint .venv/installed .venv/mitsuba .venv/extras .venv/wheel .venv/packages .venv/blender .venv/web .venv/browser  ## all tests on all models; a missing model or renderer fails
	@$(PYTEST) --full $(PYTEST_ARGS)

lint: .venv/lint .venv/biome  ## check Python, C++, GLSL, JavaScript, workflows and the container file; changes nothing
	@failed=; \
	$(BIN)/ruff format --check --quiet . || { echo "make lint: run make format"; failed=1; }; \
	$(BIN)/ruff check --quiet --output-format concise . || failed=1; \
	$(BIN)/python tools/format_native.py --check || failed=1; \
	$(BIN)/mypy --no-error-summary || failed=1; \
	test ! -f .venv/biome || $(BIOME) check --error-on-warnings || failed=1; \
	$(BIN)/python tools/check_web_types.py || failed=1; \
	$(BIN)/actionlint -shellcheck= -pyflakes= .github/workflows/*.yml || failed=1; \
	$(BIN)/zizmor --offline --no-progress --quiet .github >build/zizmor.txt || { cat build/zizmor.txt; failed=1; }; \
	$(BIN)/hadolint packaging/container/Dockerfile || failed=1; \
	test -z "$$failed"

format: .venv/lint .venv/biome  ## format Python, C++, GLSL and JavaScript in place
	@$(BIN)/ruff check --quiet --fix --select I . && $(BIN)/ruff format --quiet .
	@$(BIN)/python tools/format_native.py
	@test ! -f .venv/biome || $(BIOME) check --write --linter-enabled=false --log-level=error

lines: .venv/installed  ## lines of source by folder; beside a commit: AGAINST=COMMIT
	@$(BIN)/python tools/count_lines.py $(AGAINST:%=--against %)

hooks: .venv/lint .venv/biome  ## run make lint's checks before every git commit
	@$(PIP) pre-commit && $(BIN)/pre-commit install

fuzz: .venv/installed .venv/mitsuba .venv/extras .venv/web  ## 100,000 mutated blobs, packed views and levels through the readers under ASan and UBSan, packed views in WebAssembly, and glTF files through all commands; others with SEED=N
	@folder=$$(CXX=$${CXX:-$$(command -v g++ || command -v clang++)} $(BIN)/python -m tools.native_build MESHLET_FUZZ) \
	  && $$folder/fuzz_decoder spec/vectors $(MUTANTS) $(SEED) && $$folder/fuzz_transport spec/transport_vectors $(MUTANTS) $(SEED)
	@node tests/web/unpack.mjs web spec/transport_vectors $(MUTANTS) $(SEED)
	@$(BIN)/python -m tools.sanitized tools.fuzz_levels $(MUTANTS) $(SEED)
	@$(BIN)/python -m tests.hostile.fuzz $(MUTANTS) --seed $(SEED)

shaders: .venv/installed  ## compile shaders/ to vk_backend/spirv and bench/spirv (needs glslangValidator)
	@$(BIN)/python -m tools.build_shaders

wgsl: .venv/web  ## translate shaders/ to web/wgsl for WebGPU
	@$(BIN)/python -m tools.build_wgsl

# Measurements on a GPU have their own commands: docs/vulkan.md, docs/vulkan-raytracing.md.
bench: .venv/installed .venv/mitsuba .venv/extras .venv/bench  ## all measurements on the CPU and docs/results.md (over an hour)
	@for name in $(MEASUREMENTS); do $(BIN)/python -m bench $$name || exit 1; done

figures: .venv/installed .venv/mitsuba  ## render README's pictures again
	@$(BIN)/gltf-meshlet demo build/demo && cp $(PICTURES:%=build/demo/%.png) docs/

docs: .venv/docs  ## build the documentation's site in build/site; a broken link fails
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict --site-dir build/site && echo "build/site/index.html"

wheel: .venv/wheel  ## wheels in dist for eight platforms that install without a compiler (some minutes each)
	@$(BIN)/python -m tools.build_wheels

# PLATFORM=here builds what this machine needs, in some two minutes instead of an hour.
blender: .venv/wheel  ## the Blender extension as a zip per platform in dist; PLATFORM=here for this machine only
	@$(BIN)/python -m tools.build_wheels --only $(or $(PLATFORM),blender)
	@$(BIN)/python -m tools.build_blender --only $(or $(PLATFORM),blender)

amalgamation:  ## the decoder for C and C++ as one header and one source in dist/decoder; needs only Python
	@$(PYTHON) -m tools.amalgamate

shader-package:  ## the GPU decoder for engines, in GLSL and HLSL, as a zip in dist; needs only Python
	@$(PYTHON) -m tools.build_shader_package

# Also what build/site needs to be a repository of extensions for Blender.
packages: wheel blender amalgamation shader-package docs .venv/web .venv/packages  ## everything that a release publishes: in dist, and the site in build/site
	@mkdir -p build/site/blender && cp dist/index.json dist/gltf_meshlet-blender-$(VERSION)-*.zip build/site/blender
	@cd dist && rm -f gltf_meshlet-decoder-*.zip && $(CURDIR)/$(BIN)/python -m zipfile -c gltf_meshlet-decoder-$(VERSION).zip decoder/*
	@$(BIN)/python -m build --sdist --no-isolation --outdir dist . >build/sdist.log 2>&1 || { tail -5 build/sdist.log; exit 1; }
	@$(BIN)/twine check --strict dist/*$(VERSION)*.whl dist/*$(VERSION).tar.gz
	@npm pack --silent --pack-destination dist ./web

web: .venv/web .venv/browser  ## build the npm package's decoder, the viewer's page and build/gallery, and open the page (MODEL=FILE)
	@command -v node >/dev/null || { echo "make: node is not installed (Debian: apt install nodejs npm)"; exit 1; }
	@node web/view/build.mjs $(NODE_MODULES)/node_modules gltf_meshlet/view_page
	@$(BIN)/python -m tools.build_gallery build/gallery $$($(DEMO_MODEL)) $$($(GALLERY_MODELS))
	@ls -l web/*.wasm gltf_meshlet/view_page build/gallery
	@! test -t 1 || $(BIN)/gltf-meshlet view $(or $(MODEL),$$($(DEMO_MODEL)))

test-web: .venv/web .venv/browser  ## tests of the npm package, also in Chromium and Firefox
	@$(PYTEST) tests/web $(PYTEST_ARGS)

# Any process takes any test: one file has most of them.
test-platforms: wheel .venv/platforms  ## tests of all wheels: Windows by wine, ARM64 by qemu, musl, each Python that can be had
	@$(PYTEST) --dist worksteal --platforms tests/platforms $(PYTEST_ARGS)

clean:  ## remove everything that make made here
	rm -rf .venv build dist web/decoder.wasm web/unpacker.wasm demo-output .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' && $(PYTHON) -m venv .venv \
	  || { rm -rf .venv; echo "make: cannot create .venv; needs Python 3.10 or newer with its venv module (Debian: apt install python3-venv)"; exit 1; }

.venv/build-tools: pyproject.toml | .venv/bin/python
	@echo "installing into .venv"
	@$(PIP) $(BUILD_TOOLS) $$($(BIN)/python tools/build_backend.py) || { echo "make: cannot install $(BUILD_TOOLS); is a Python package index reachable?"; exit 1; }
	@touch $@

# An editable install: Python edits count at once, C++ edits and the version through this rule. With
# meshoptimizer's simplifier inside, as in a wheel, where PyPI has its sources.
.venv/installed: .venv/build-tools gltf_ext/__init__.py $(NATIVE)
	@simplifier=$$($(BIN)/python -m tools.build_wheels --simplifier) \
	  || echo "make: cannot get meshoptimizer's sources; levels of detail need the package, which has no guard"; \
	$(PIP) --no-build-isolation --config-settings=cmake.define.MESHLET_SIMPLIFIER="$$simplifier" --editable ".[test]" \
	  || { echo "make: cannot install the project; is a Python package index reachable, and does the C++ compiler know C++17?"; exit 1; }
	@touch $@

# mypy reads the types of the project's dependencies, hence .venv/installed.
.venv/lint: pyproject.toml | .venv/installed
	@$(PIP) "gltf-meshlet[lint]" || { echo "make: cannot install the linters that pyproject.toml names"; exit 1; }
	@touch $@

.venv/biome: biome.json | .venv/bin/python
	@npm install --silent --no-audit --no-fund --prefix $(NODE_MODULES) $(BIOME_PACKAGE) >/dev/null 2>&1 \
	  && touch $@ || echo "make: cannot install the npm package $(BIOME_PACKAGE); JavaScript is not linted or formatted"

# Mitsuba, and its plugin ahead of the first render. Everything else works without.
.venv/mitsuba: pyproject.toml $(NATIVE) $(PLUGIN) | .venv/installed
	@if $(PIP) "gltf-meshlet[mitsuba]" 2>/dev/null; then $(BIN)/python mitsuba_plugin/build.py; else false; fi \
	  || echo "make: Mitsuba cannot be used; its tests are skipped and the demo renders nothing"
	@touch $@

# Some tests need these; without them they are skipped, with the reason.
.venv/extras: pyproject.toml tools/system_packages.py | .venv/installed
	@$(PIP) "gltf-meshlet[draco]" 2>/dev/null || echo "make: cannot install DracoPy; tests on Draco input are skipped"
	@$(PIP) "gltf-meshlet[lod]" 2>/dev/null || echo "make: cannot install meshoptimizer; tests of levels of detail are skipped"
	@$(PIP) "gltf-meshlet[vulkan]" 2>/dev/null || echo "make: cannot install the Python package vulkan; tests of the Vulkan renderer are skipped"
	@npm install --silent --no-audit --no-fund --prefix $(NODE_MODULES) $(NODE_PACKAGES) >/dev/null 2>&1 \
	  || echo "make: cannot install the npm packages $(NODE_PACKAGES); tests with them are skipped"
	@$(BIN)/python tools/system_packages.py
	@touch $@

# The peers that the measurements run.
.venv/bench: pyproject.toml | .venv/installed
	@npm install --silent --no-audit --no-fund --prefix $(NODE_MODULES) $(BENCH_PACKAGES) >/dev/null 2>&1 \
	  || echo "make: cannot install the npm packages $(BENCH_PACKAGES); bench web cannot run"
	@$(PIP) "gltf-meshlet[bench]" 2>/dev/null || echo "make: cannot install scipy, DracoPy or meshoptimizer; their columns stay empty"
	@touch $@

.venv/packages: pyproject.toml | .venv/installed
	@$(PIP) "gltf-meshlet[recipes]" || { echo "make: cannot install build, twine, Conan and rattler-build"; exit 1; }
	@touch $@

.venv/wheel: pyproject.toml | .venv/installed
	@$(PIP) "gltf-meshlet[wheel]" || { echo "make: cannot install ziglang"; exit 1; }
	@touch $@

# Wine, qemu and the Pythons that they run. Without one, its tests are skipped.
.venv/platforms: pyproject.toml tools/system_packages.py tools/other_pythons.py | .venv/installed
	@$(PIP) "gltf-meshlet[platforms]" || { echo "make: cannot install lief and meshoptimizer"; exit 1; }
	@$(BIN)/python tools/system_packages.py platforms
	@$(BIN)/python -m tools.other_pythons
	@touch $@

# Blender as a Python module. Not in .venv: it is made for Python 3.11 only.
.venv/blender: | .venv/installed
	@echo "installing $(BPY) into build/bpy (1 GB)"
	@python=$$($(BIN)/python -c 'from tools.blender_python import find_python; print(find_python((3, 11)))') \
	  && $$python -m venv build/bpy && build/bpy/bin/pip install -qq --disable-pip-version-check $(BPY) 2>/dev/null \
	  && touch $@ || { rm -rf build/bpy; echo "make: cannot install $(BPY) for Python 3.11; tests of the Blender extension fail"; }

# What bundles the viewer's page, and what the tests in browsers need.
.venv/browser: tools/system_packages.py | .venv/installed
	@$(BIN)/python tools/system_packages.py browsers
	@npm install --silent --no-audit --no-fund --prefix $(NODE_MODULES) $(BROWSER_PACKAGES) >/dev/null 2>&1 \
	  && touch $@ || echo "make: cannot install the npm packages $(BROWSER_PACKAGES); tests of the viewer's page and in browsers are skipped"

.venv/web: pyproject.toml $(WEB) | .venv/installed
	@command -v node >/dev/null || echo "make: node is not installed; tests of the WebAssembly decoder are skipped"
	@npm install --silent --no-audit --no-fund --prefix $(NODE_MODULES) $(WEB_PACKAGES) >/dev/null 2>&1 \
	  || echo "make: cannot install the npm packages $(WEB_PACKAGES); tests of the plugins and of WebGPU are skipped"
	@$(PIP) "gltf-meshlet[web]" && $(BIN)/python tools/build_wasm.py \
	  || echo "make: cannot compile web/*.wasm; their tests are skipped"
	@touch $@

.venv/docs: pyproject.toml | .venv/installed
	@$(PIP) "gltf-meshlet[docs]" || { echo "make: cannot install mkdocs"; exit 1; }
	@touch $@
