# Thin: every target is one or two commands. VENV and PYTHON can be set from outside.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
UV     := $(VENV)/uv-bootstrap/bin/uv
OUT    ?= demo-output
PEERS  := .venv-peers
PLANNERS := .venv-planners
VIEWERS := .venv-viewers
SLIM := .venv-slim
AUDITOR := .venv-audit
# Where pip is configured with a local folder of wheels, uv (which ignores pip's configuration) is told of it; that folder
# holds torch's CPU build. Elsewhere torch is the build of PyTorch's index that suits the machine (auto; cpu, cu130, ...): its
# hash is not known, so it alone is not checked. `make setup TORCH_BACKEND=` takes PyPI's build (several GB on Linux), checked.
# The pip that installed uv is asked: it is there whether or not the environment, which has none, is activated.
# (`pip config get` overlooks PIP_CONFIG_FILE.) Once a run.
FIND_LINKS = $(eval FIND_LINKS := $(shell $(VENV)/uv-bootstrap/bin/python -m pip config list 2>/dev/null | \
  sed -n "/^[^=]*\.find-links=/{s/[^=]*='\(.*\)'/\1/;s/\\\\n/ /g;p;q}"))$(FIND_LINKS)
TORCH_BACKEND ?= $(if $(FIND_LINKS),,auto)
LOCKS = constraints.txt $(if $(FIND_LINKS),constraints-cpu.txt)
HASHED = $(if $(TORCH_BACKEND),--torch-backend $(TORCH_BACKEND),$(addprefix --find-links ,$(FIND_LINKS)) --require-hashes)
LOCKED = $(HASHED) $(addprefix -c ,$(LOCKS))
# What bimvox[full] needs.
FULL = -r pyproject.toml --extra full
# bimvox itself, from this folder, built with the locked setuptools.
OURSELVES = --no-deps --no-build-isolation -e .

# Some machines tell Python not to keep byte code: every process of the tests and the demo would translate all libraries again.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-slow test-all test-page test-slim test-fleet sizes check lint types contracts samples bench bench-real-files bench-motion check-log bench-voxelize bench-environment bench-render \
	bench-planning bench-yard bench-class-rates bench-watch bench-scale bench-studio bench-many-lifts bench-generalist bench-sequence bench-generalist-seeds bench-decision bench-live bench-cold bench-frozen train-generalist soak-watch soak-files \
	picture film sketches site constraints audit advisories wheel release clean

help: ## this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | awk -F'\t' '{printf "  make %-14s %s\n", $$1, $$2}'

$(UV): bootstrap.txt
	$(PYTHON) -m venv $(VENV)/uv-bootstrap
	$(VENV)/uv-bootstrap/bin/python -m pip install --quiet --require-hashes --only-binary :all: -r bootstrap.txt
	@touch $@

$(BIN)/bimvox: pyproject.toml setup.py constraints.txt constraints-cpu.txt | $(UV)
	test -x $(BIN)/python || $(PYTHON) -m venv --without-pip $(VENV)
	$(UV) pip install --quiet --python $(BIN)/python $(LOCKED) $(FULL) --group dev
	$(UV) pip install --quiet --python $(BIN)/python $(OURSELVES)
	@touch $@

$(VENV)/warm: $(BIN)/bimvox
	$(BIN)/bimvox warm-up
	@touch $@

setup: $(VENV)/warm ## make the virtual environment, install everything into it, compile the kernels

demo: setup ## the main job on a sample building: voxelize, plan, verify, render
	@$(BIN)/bimvox demo -o $(OUT)

test: setup ## the tests that are quick; all but fleets, trainings, soaks and the like, which CI runs too
	$(BIN)/bimvox warm-up -q
	$(BIN)/python -m pytest -m "not slow"

test-slow: setup ## the tests that take long
	$(BIN)/python -m pytest -m slow

test-all: test test-slow ## the whole test suite

test-page: setup ## the pages in a real headless Chromium
	$(UV) pip install --quiet --python $(BIN)/python $(LOCKED) --group browser
	$(BIN)/python -m pytest -m browser tests/rendering -n 0

# An environment of its own, made anew each time: the wheel and what `bimvox` alone needs, without the extras of bimvox[full].
test-slim: wheel ## the wheel without its extras: size, the acts, and what it says when training is asked of it
	rm -rf $(SLIM)
	$(PYTHON) -m venv --without-pip $(SLIM)
	$(UV) pip install --quiet --python $(SLIM)/bin/python $(LOCKED) -r pyproject.toml
	$(UV) pip install --quiet --python $(SLIM)/bin/python --no-deps --no-index --find-links dist bimvox
	BIMVOX_SLIM=$(abspath $(SLIM)) $(BIN)/python -m pytest tests/test_slim.py -n 0

test-fleet: setup ## fleets on a real local Ray and a real local Dask cluster, and the Parquet table
	$(UV) pip install --quiet --python $(BIN)/python $(LOCKED) $(FULL) --extra ray --extra dask --extra parquet
	$(BIN)/python -m pytest tests/pipeline/fleet -n 0 -rs

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff check --quiet --preview --select PLW1514 bimvox pipeline cli # every text file names its encoding
	$(BIN)/ruff format --check .

SHIPPED = -p bimvox -p bimvox_pipeline -p bimvox_cli
types: setup
	$(BIN)/mypy
	$(BIN)/mypy $(SHIPPED) --platform win32 --cache-dir .mypy_cache/win32
	$(BIN)/mypy $(SHIPPED) --platform darwin --cache-dir .mypy_cache/darwin

contracts: setup
	$(BIN)/lint-imports --no-cache

check: lint types contracts test ## ruff, strict mypy, import contracts, tests: run it before every commit

samples: setup ## write the sample models again (they are byte-identical each time)
	$(BIN)/python -m sample_models.write

bench: setup ## plan and prove every sample model: docs/data/measured.txt
	$(BIN)/python -m benchmarks.samples $(ARGS)

bench-real-files: setup ## files planned unedited: parts, machine, processor time by stage, proof (ARGS="FOLDER ..."): docs/measured.md
	$(BIN)/python -m benchmarks.real_files $(ARGS)

bench-motion: setup ## how the crane drives the samples: time over the bound, swing, limits: docs/data/measured.txt
	$(BIN)/python -m benchmarks.motion $(ARGS)

$(VIEWERS)/ready: | $(UV)
	test -x $(VIEWERS)/bin/python || $(PYTHON) -m venv --without-pip $(VIEWERS)
	for tool in pymcap-cli rerun-sdk mpxj jpype1; do \
	  $(UV) pip install --quiet --python $(VIEWERS)/bin/python "$$tool" || echo "not installed: $$tool"; done
	touch $@

check-log: setup $(VIEWERS)/ready ## other people's readers of a log and of its schedule (LOG=file; default: the sample frame, planned)
	$(BIN)/python -m benchmarks.check_log $(VIEWERS)/bin $(LOG)

bench-environment: setup ## steps a second of the paper's environment, through each interface
	$(BIN)/python benchmarks/environment.py

bench-render: setup ## seconds a picture and a frame of a 500-part plan
	$(BIN)/python benchmarks/render.py

$(PEERS)/ready: benchmarks/peers.txt pyproject.toml constraints.txt | $(UV)
	test -x $(PEERS)/bin/python || $(PYTHON) -m venv --without-pip $(PEERS)
	$(UV) pip install --quiet --python $(PEERS)/bin/python $(LOCKED) $(FULL) --group build
	$(UV) pip install --quiet --python $(PEERS)/bin/python $(OURSELVES)
	grep -v '^#' benchmarks/peers.txt | while read -r peer; do \
	  $(UV) pip install --quiet --python $(PEERS)/bin/python -c constraints.txt "$$peer" || echo "not installed: $$peer"; done
	@touch $@

bench-voxelize: $(PEERS)/ready ## the voxelizer against its peers: docs/voxelizing.md (ARGS=--quick for a try)
	$(PEERS)/bin/python -m benchmarks.voxelize $(ARGS)

bench-planning: setup ## what the chosen order and yard save, and the share of the narrow phase
	$(BIN)/python -m benchmarks.planning $(ARGS)

bench-yard: setup ## what smaller truckloads save: docs/data/measured.txt
	$(BIN)/python -m benchmarks.yard $(ARGS)

bench-class-rates: setup ## minutes a part by class of work, next to published rates: docs/work.md
	$(BIN)/python -m benchmarks.class_rates

bench-watch: setup ## from a changed obstruction file to the new plan on disk: docs/watching.md
	$(BIN)/python -m benchmarks.watch $(ARGS)

bench-scale: setup ## 50 to 5,000 components planned and proven: docs/scale.md
	$(BIN)/python -m benchmarks.scale $(ARGS)

bench-optimise: setup ## what optimise finds, against init, the classical estimate, a grid, random ones and a bound (ARGS="MODEL ... --write"): docs/data/optimise.txt
	$(BIN)/python -m benchmarks.optimise $(or $(ARGS),sample_models/prefab.ifc)

bench-studio: setup ## dragging in the studio with 500 parts, in a headless Chromium: docs/scale.md
	$(UV) pip install --quiet --python $(BIN)/python $(LOCKED) --group browser
	$(BIN)/python -m benchmarks.dragging

soak-watch: setup ## many random changes of a watched file, with all that may go wrong (ARGS="--changes 100" for a try)
	$(BIN)/python -m benchmarks.soak_watch $(ARGS)

$(PLANNERS)/ready: benchmarks/many_lifts/peers.txt pyproject.toml constraints.txt | $(UV)
	test -x $(PLANNERS)/bin/python || $(PYTHON) -m venv --without-pip $(PLANNERS)
	$(UV) pip install --quiet --python $(PLANNERS)/bin/python $(LOCKED) $(FULL) --group build
	$(UV) pip install --quiet --python $(PLANNERS)/bin/python $(OURSELVES)
	grep -v '^#' benchmarks/many_lifts/peers.txt | while read -r peer; do \
	  $(UV) pip install --quiet --python $(PLANNERS)/bin/python -c constraints.txt "$$peer" || echo "not installed: $$peer"; done
	@touch $@

bench-many-lifts: $(PLANNERS)/ready ## paths of 500 lifts: policy, search, and other planners
	$(PLANNERS)/bin/python -m benchmarks.many_lifts $(ARGS)

train-generalist: setup ## train the network that ships with bimvox: docs/generalist.md (OUT=folder, ARGS="--steps 4000" for a try)
	$(BIN)/python -m benchmarks.train_generalist --out $(OUT)/generalist $(ARGS)

bench-generalist: setup ## the shipped network and its baselines on the held-out suite (ARGS="--share 0.1" for a try)
	$(BIN)/python -m benchmarks.generalist $(ARGS)

bench-sequence: setup ## orders of whole buildings, proven: docs/sequence-v0.md (ARGS="--run search", ARGS="--add mine.json"; without: whether page and data agree)
	$(BIN)/python -m benchmarks.sequence $(ARGS)

bench-generalist-seeds: setup ## five training seeds with and without the teacher (OUT=folder, ARGS="--steps 4000" for a try)
	$(BIN)/python -m benchmarks.generalist_seeds --out $(OUT)/generalist-seeds $(ARGS)

bench-decision: setup ## microseconds of one decision of the shipped policy: docs/data/generalist.txt
	$(BIN)/python -m benchmarks.decision $(ARGS)

bench-live: setup ## seconds lost a lift in simulated traffic, by who decides (20 minutes): docs/live.md
	$(BIN)/python -m benchmarks.live $(ARGS)

bench-frozen: setup ## the bytes that the program writes, against those recorded (ARGS="--only watch" for some cases)
	$(BIN)/python -m benchmarks.frozen $(ARGS)

bench-cold: setup ## what a first run compiles: the demo's commands with an empty folder of machine code (ARGS="--first warm-up")
	$(BIN)/python -m benchmarks.cold $(ARGS)

soak-files: setup ## every IFC file under DIR ends in a grid or a clear error: make soak-files DIR=folder
	$(BIN)/python -m benchmarks.many_files $(DIR) $(ARGS)

picture: setup ## draw the README's picture again
	mkdir -p $(OUT)
	$(BIN)/bimvox init sample_models/prefab.ifc -o $(OUT)/prefab.site.toml --force
	cp $(OUT)/prefab.site.svg docs/images/site.svg
	$(BIN)/bimvox plan $(OUT)/prefab.site.toml -o $(OUT)/prefab.mcap
	$(BIN)/bimvox render $(OUT)/prefab.mcap --lift 71 -o docs/images/prefab.png
	$(BIN)/bimvox render $(OUT)/prefab.mcap --size 480x300 --fps 8 --seconds 12 -o docs/images/assembly.gif

film: picture ## film the page, photograph studio and report, with Playwright and a Chromium (BIMVOX_BROWSER): docs/images/*.webp
	$(BIN)/bimvox render $(OUT)/prefab.mcap -o $(OUT)/prefab.html
	$(BIN)/bimvox report $(OUT)/prefab.mcap -o $(OUT)/prefab.report.html
	$(BIN)/python -m benchmarks.page_film $(OUT)/prefab.html docs/images/page.webp --report $(OUT)/prefab.report.html docs/images/report.webp --studio $(OUT)/prefab.site.toml docs/images/studio.webp

sketches: setup ## draw the sketches of the docs again: docs/images/sketch-*.svg
	$(BIN)/python -m docs.sketches

site: setup ## the docs as a site: offline search, pages of commands and formats, notebooks executed
	$(UV) pip install --quiet --python $(BIN)/python $(LOCKED) --group docs
	OMP_NUM_THREADS=1 $(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_site/html
	@echo "docs/_site/html/index.html"

# One resolution for all platforms: the index gives the hashes of every file of a version, whatever platform it is for.
# torch==2.13.0: constraints-cpu.txt has the hash of that version's CPU build.
COMPILE = $(UV) pip compile --quiet --universal --python-version 3.11 --no-header --no-annotate --generate-hashes --upgrade
constraints: $(UV) ## resolve the pinned versions and their hashes again (UV_VERSION=... for another uv)
	echo 'torch==2.13.0' > $(VENV)/pins.txt
	$(COMPILE) -c $(VENV)/pins.txt --all-extras --group dev --group browser --group docs --group audit pyproject.toml -o $(VENV)/locked.txt
	{ head -1 constraints.txt; cat $(VENV)/locked.txt; } > $(VENV)/constraints.txt
	mv $(VENV)/constraints.txt constraints.txt
	$(if $(UV_VERSION),echo 'uv==$(UV_VERSION)' | $(COMPILE) - -o $(VENV)/uv.txt && \
	  { head -1 bootstrap.txt; cat $(VENV)/uv.txt; } > $(VENV)/bootstrap.txt && mv $(VENV)/bootstrap.txt bootstrap.txt)

audit: setup ## the installed packages and their files against the lock file's versions and hashes; needs no network
	$(BIN)/python -m supply.audit $(LOCKS)

$(AUDITOR)/ready: pyproject.toml constraints.txt | $(UV)
	test -x $(AUDITOR)/bin/python || $(PYTHON) -m venv --without-pip $(AUDITOR)
	$(UV) pip install --quiet --python $(AUDITOR)/bin/python $(LOCKED) --group audit
	@touch $@

advisories: audit $(AUDITOR)/ready ## known vulnerabilities of what is installed; asks the network
	$(AUDITOR)/bin/pip-audit --path "$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"

wheel: setup ## build the wheel, with its SBOM (CycloneDX JSON) and checksums next to it: dist/
	$(BIN)/python -m supply.wheel $(LOCKS)

sizes: setup ## MB of the packages that bimvox needs, and of each extra: the table of docs/install.md
	$(BIN)/python -m supply.sizes

release: setup ## VERSION=0.2.0: changelog, version, commit, tag, wheel, SBOM, checksums; pushes nothing
	$(BIN)/python -m supply.release $(VERSION) $(LOCKS)

words: setup ## OMW=folder with the tables of the Open Multilingual Wordnet: words of materials in more languages
	$(BIN)/python -m supply.words $(OMW)

clean: ## remove the virtual environment and what the demo wrote
	rm -rf $(VENV) $(SLIM) $(PEERS) $(PLANNERS) $(VIEWERS) $(AUDITOR) $(OUT) build dist *.egg-info
