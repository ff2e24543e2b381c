# Every target makes what it needs; with Python 3.11, pip and make, `make walk` and `make test` are all you type.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
SHELL := bash

# The batched simulation brings its own threads; a second pool beside it in BLAS or torch only costs time.
export OMP_NUM_THREADS ?= 1

# On every core, neighbours together as long as no core is idle: what the tests of a file share is made once or twice.
# Python keeps its bytecode whatever the environment says: else each worker and each of many short commands compiles all.
# Each copy of MuJoCo's data reserves 15 MB, mostly untouched: in the heap, many would make a worker too large to fork.
PYTEST := PYTHONDONTWRITEBYTECODE= MALLOC_MMAP_THRESHOLD_=4194304 $(BIN)/python -m pytest --numprocesses auto --dist worksteal

.PHONY: help install walk predict answers test test-all test-wheel test-sdist test-lowest notebooks licences test-learners test-rllib test-kills fuzz extremes mutants check format bench benchmark docs lock clean

help:
	@echo "make walk     train with the defaults, then evaluate what was trained (results in runs/)"
	@echo "make test     run the quick tests, in four minutes on two cores"
	@echo "make test-all run all tests, those marked slow too (trainings, kills, studies twice): nine minutes on two cores"
	@echo "make test-wheel  build the wheel and with it alone, in an empty folder: all commands of README, examples, policies"
	@echo "make test-sdist  build the source distribution, and run its tests in an empty folder"
	@echo "make test-lowest run the quick tests with the lowest versions that pyproject.toml allows"
	@echo "make notebooks  run examples/notebooks in a Jupyter kernel, in an environment of its own"
	@echo "make licences  licences and SBOM of what users of the wheel get: build/licences.md, build/sbom.json"
	@echo "make test-learners  train with every library of docs/how-to/learners.md, each outside $(VENV); goes on after a stop"
	@echo "make test-rllib  train with RLlib on several Ray nodes of this machine, kill some, in an environment of its own"
	@echo "make test-kills   end 20 trainings several times each, resume them, and compare them with uninterrupted ones"
	@echo "make fuzz     change files of every kind at random for ten minutes, and read them"
	@echo "make extremes ten million extreme steps in drawn settings: is all finite, and the memory flat?"
	@echo "make mutants  60 wrong signs, comparisons and indices: does a test fail? hours; goes on after a stop"
	@echo "make check    format, lint, types, import floors, all tests: what has to pass before a change lands"
	@echo "make docs     build the site in build/site; a warning is an error"
	@echo "make format   apply the format and the lint fixes"
	@echo "make bench    cost of a step against MuJoCo's own, and of training; figures in build/bench.json"
	@echo "make benchmark  springs and our PPO, five seeds, on the tasks that set stiffness, submitted and judged; an hour; goes on after a stop"
	@echo "make install  only $(VENV), from requirements.lock; the others do it by themselves"
	@echo "make lock     requirements.lock anew: the versions of constraints.txt with the hash of every file"
	@echo "make predict  a walk from nothing: plan, person, evaluation; goes on after a stop"
	@echo "make answers  the studies of docs/answers.md in build/answers; goes on after a stop; QUICK=1: their shape in a minute"
	@echo "make clean    remove .venv, builds and caches, never runs/"

install: $(VENV)/installed

# A CPU build of torch that is there already stays.
$(VENV)/installed: pyproject.toml constraints.txt requirements.lock
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --disable-pip-version-check --require-hashes --no-deps --requirement requirements.lock
	$(BIN)/pip install --disable-pip-version-check --constraint constraints.txt torch
	$(BIN)/pip install --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

# What .[train,dev] and torch need, without torch, whose builds differ, and its CUDA.
lock:
	$(PYTHON) -m venv build/lock
	build/lock/bin/pip install --disable-pip-version-check --constraint constraints.txt uv
	printf '%s\n' filelock fsspec jinja2 networkx sympy typing-extensions | UV_CUSTOM_COMPILE_COMMAND="make lock" \
	  build/lock/bin/uv pip compile pyproject.toml - --extra train --extra dev --constraint constraints.txt \
	  --override <(echo "torch ; sys_platform == 'never'") --no-emit-package torch \
	  --generate-hashes --universal --python-version 3.11 --no-annotate --quiet --output-file requirements.lock

# runs/walk is the first, runs/walk-2 the next: train.py refuses a folder that already holds a run.
walk: install
	@mkdir -p runs; out=runs/walk; n=2; set -e; \
	until mkdir "$$out" 2> /dev/null; do [ -e "$$out" ] || exit 1; out=runs/walk-$$n; n=$$((n + 1)); done; \
	$(BIN)/python train.py --out "$$out"; \
	$(BIN)/python evaluate.py "$$out" --out "$$out/evaluation"; \
	printf '%s\n' "" "Policy:   $$out/best.safetensors" "Numbers:  $$out/evaluation/metrics.json" \
	  "Pictures: $$out/evaluation/gait.png, $$out/evaluation/walk.gif"

test: install
	$(PYTEST) -m "not slow"

test-all: install
	$(PYTEST)

# A folder with the source distribution of what git knows, and an empty one.
define PACK
set -e; folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; mkdir "$$folder/git" "$$folder/empty"; \
git archive HEAD | tar -x -C "$$folder/git"; make_sdist='from setuptools import build_meta; build_meta.build_sdist("..")'; \
(cd "$$folder/git"; "$(abspath $(BIN))/python" -c "$$make_sdist" > "$$folder/log" 2>&1) || { cat "$$folder/log"; exit 1; }
endef

# As users get it: in an empty folder, first with what the environments need alone; then each extra is missed, and comes.
# benchmarks/wheel.py follows README, and runs the examples and every policy.
test-wheel: install
	@$(PACK); clone=$$PWD; $(PYTHON) -m venv "$$folder/venv"; PATH="$$folder/venv/bin:$$PATH"; \
	pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$$folder" "$$folder"/*.tar.gz; \
	add() { pip install --quiet --disable-pip-version-check --constraint "$$clone/constraints.txt" \
	  "springfoot$$1 @ file://$$(echo "$$folder"/*.whl)"; }; \
	cd "$$folder/empty"; set -x; \
	add; pip list --disable-pip-version-check; \
	springfoot --version; python -W error -c 'import gymnasium as gym; \
	  env = gym.make("springfoot.envs:SegmentedFootBiped-v0"); env.reset(seed=0); env.step(env.action_space.sample()); \
	  envs = gym.make_vec("springfoot.envs:SegmentedFootBiped-v0", num_envs=4); envs.reset(seed=0)'; \
	springfoot; springfoot --help; springfoot study --help; \
	springfoot evaluate pretrained 2>&1 | grep -F "pip install 'springfoot[evaluate]'"; \
	add "[evaluate]"; \
	springfoot evaluate pretrained --episodes 1; springfoot study compare schedule --quick; \
	springfoot train --out runs/walk 2>&1 | grep -F "pip install 'springfoot[train]'"; \
	add "[train,live,minari]"; \
	MINARI_DATASETS_PATH=$$PWD python "$$clone/benchmarks/wheel.py" "$$clone/README.md"; ls runs/*; \
	add "[onnx]"; \
	springfoot export runs/walk --out walk.onnx; springfoot evaluate walk.onnx --episodes 1

# The unpacked source distribution passes its own tests, in an environment that it makes itself. Not $(MAKE): with
# --dry-run, which a test gives, that line would run.
test-sdist: install
	@$(PACK); tar -xf "$$folder"/*.tar.gz -C "$$folder/empty"; cd "$$folder"/empty/*; make test-all VENV=.venv

# Of torch, of which old CPU builds are not to be had everywhere, the pinned version. Old libraries use what newer ones
# have deprecated; NumPy 2.0 makes an error of its own of a signal while it is imported.
test-lowest: build/lowest/installed
	build/lowest/bin/python -m pytest --numprocesses auto --dist worksteal -m "not slow" -W ignore::DeprecationWarning \
	  --deselect tests/files/test_locks.py::test_a_signal_at_the_start_is_one_line_and_leaves_nothing \
	  tests/files tests/gait tests/envs tests/agents tests/evaluation tests/cli

build/lowest/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv build/lowest
	build/lowest/bin/pip install --disable-pip-version-check --constraint constraints.txt uv
	build/lowest/bin/uv pip install --python build/lowest/bin/python --resolution lowest-direct \
	  --override <(echo "torch ; sys_platform == 'never'") --editable ".[train,dev]"
	build/lowest/bin/pip install --disable-pip-version-check --constraint <(grep '^torch==' constraints.txt) torch
	@touch $@

# Executed, never stored: notebooks stay without outputs.
notebooks: build/notebooks/installed
	build/notebooks/bin/jupyter-execute examples/notebooks/*.ipynb

build/notebooks/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv build/notebooks
	build/notebooks/bin/pip install --disable-pip-version-check --constraint constraints.txt --editable ".[evaluate]" \
	  nbclient ipykernel
	@touch $@

# Of what a user of the wheel gets: all extras but rllib, which pins another Gymnasium, and those of developers. The
# tools read the version from a copy of pyproject.toml, which has none itself.
licences: build/licences/installed
	build/licences/bin/pip-licenses --python build/licences/user/bin/python --with-urls --format markdown --output-file build/licences.md
	sed "s/^dynamic = .*/version = \"$$(build/licences/user/bin/springfoot --version | cut -d' ' -f2)\"/" pyproject.toml \
	  > build/licences/pyproject.toml
	build/licences/bin/cyclonedx-py environment --pyproject build/licences/pyproject.toml --output-file build/sbom.json \
	  build/licences/user/bin/python

build/licences/installed: constraints.txt pyproject.toml
	$(PYTHON) -m venv build/licences
	build/licences/bin/pip install --disable-pip-version-check --constraint constraints.txt pip-licenses cyclonedx-bom
	$(PYTHON) -m venv build/licences/user
	build/licences/user/bin/pip install --disable-pip-version-check --constraint constraints.txt \
	  --editable ".[train,onnx,live,minari,c3d,parquet,film]"
	@touch $@

test-learners: install build/learners/many/installed
	$(BIN)/python -m benchmarks.learners

test-kills: install
	$(BIN)/python -m benchmarks.kills

# All of constraints.txt but filelock, of which Tianshou wants an older one.
build/learners/many/installed: examples/learners/requirements-many.txt constraints.txt pyproject.toml
	$(PYTHON) -m venv build/learners/many
	grep -v '^filelock==' constraints.txt > build/learners/many/constraints.txt
	build/learners/many/bin/pip install --disable-pip-version-check --constraint build/learners/many/constraints.txt \
	  --requirement $< --editable ".[evaluate]" torch
	@touch $@

# RLlib pins another Gymnasium than ours.
test-rllib: build/rllib/installed
	build/rllib/bin/python -m pytest tests/agents/training/cluster/test_rllib.py

build/rllib/installed: constraints.txt pyproject.toml
	$(PYTHON) -m venv build/rllib
	grep -v '^gymnasium==' constraints.txt > build/rllib/constraints.txt
	build/rllib/bin/pip install --disable-pip-version-check --constraint build/rllib/constraints.txt \
	  --editable ".[rllib]" torch pytest
	@touch $@

# The tests take the processors that pyright, which needs one for a minute, leaves.
check: install build/typing/made
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	PYTHONPATH=build/typing $(BIN)/lint-imports
	$(BIN)/pyright --pythonpath $(BIN)/python > build/pyright.txt & pyright=$$!; \
	$(PYTEST); tests=$$?; wait $$pyright; types=$$?; cat build/pyright.txt; exit $$((tests || types))

docs: install build/typing/made $(VENV)/docs
	$(BIN)/python docs/generate.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

$(VENV)/docs: pyproject.toml constraints.txt | $(VENV)/installed
	$(BIN)/pip install --disable-pip-version-check --constraint constraints.txt --editable ".[docs]"
	@touch $@

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Each stage is kept in runs/predict: after a stop the same command goes on.
predict: install
	$(BIN)/springfoot study predict

# The studies that docs/answers.md rests on, with the persons of the package, each into a folder: two at a time with
# `make -j2 answers`, with the same bits. Their walks are kept in build/answers/kept: after a stop the same command goes on.
ANSWERS := build/answers$(if $(QUICK),-quick)
PERSONS := $(if $(QUICK),learned,learned learned-2 learned-3 learned-4 learned-5)

answers: $(foreach study,landscape when toe effects controls,$(ANSWERS)/$(study)/report.md)

$(ANSWERS)/%/report.md: $(if $(QUICK),FORCE) | install
	$(if $(QUICK),rm -rf $(@D))
	@began=$$SECONDS; \
	$(BIN)/python -m springfoot study $* $(PERSONS) --out $(@D) $(if $(QUICK),--quick,--keep $(ANSWERS)/kept/$*) \
	  && echo "$*: $$((SECONDS - began)) s"

FORCE:

bench: install
	$(BIN)/python -m benchmarks.bench

# BENCHMARK="--learners sac --tasks Walk-v0": another learner; --help tells all.
benchmark: install $(if $(findstring --learners,$(BENCHMARK)),build/learners/many/installed)
	$(BIN)/python -m benchmarks.tasks $(BENCHMARK)

fuzz: install
	$(BIN)/python -m benchmarks.fuzz_readers --seconds 600

extremes: install
	$(BIN)/python -m benchmarks.extreme_steps --steps 10000000

# MUTANTS="--count 20 --seed 1": others; --help tells all.
mutants: install
	$(BIN)/python -m benchmarks.mutants $(MUTANTS)

# What pyright and import-linter cannot see: the rooms behind an editable install's finder; and the names MuJoCo compiles in
# (no stubs yet).
ROOT_FILES = $(wildcard package/*.py) package/py.typed
build/typing/made: Makefile $(ROOT_FILES)
	rm -rf build/typing && mkdir -p build/typing/springfoot build/typing/mujoco-stubs
	ln -s $(addprefix ../../../,$(ROOT_FILES) files gait envs agents evaluation studies cli) build/typing/springfoot/
	echo partial > build/typing/mujoco-stubs/py.typed
	printf '%s\n' 'from typing import Any' 'def __getattr__(name: str) -> Any: ...' > build/typing/mujoco-stubs/__init__.pyi
	@touch $@

clean:
	rm -rf .venv build dist *.egg-info .pytest_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -prune -exec rm -rf {} +
