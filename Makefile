# Everything runs in .venv, built from requirements.lock. `make` alone lists the targets.
# Another interpreter: make PYTHON=python3.12 setup

PYTHON ?= python3
VENV := .venv
# Tests at a time: each may take 1.5 GB.
TEST_WORKERS ?= 2
BIN := $(VENV)/bin
CREATED := $(VENV)/.created
INSTALLED := $(VENV)/.installed

# A .venv that was made in another folder, or by another Python than the one asked for, is made again; a link to one
# belongs to somebody else.
ASKED := $(if $(filter file,$(origin PYTHON)),,$(PYTHON))
STALE := $(shell [ -e $(CREATED) ] && [ ! -L $(VENV) ] || exit 0; \
  head -n 3 $(BIN)/pip 2>/dev/null | grep -qF -e "$$(pwd)/$(VENV)/" -e "$$(pwd -P)/$(VENV)/" || echo folder; \
  [ -z "$(ASKED)" ] || [ "$$($(ASKED) -V 2>/dev/null)" = "$$($(BIN)/python -V 2>/dev/null)" ] || echo python)
ifneq ($(STALE),)
$(shell rm -rf $(VENV); echo "$(VENV) was made in another folder or by another Python: it is made again" >&2)
endif

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help setup demo study test test-slow test-all dist fresh-check regress validate fuzz crash mutants paraview-check docs lint lock clean

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' Makefile | sed -E 's/^([a-z-]+):.*## (.*)$$/\1|\2/' | awk -F'|' '{printf "  make %-15s %s\n", $$1, $$2}'

# A virtual environment whose creation was interrupted has no pip: it is made again.
$(CREATED):
	@command -v $(PYTHON) >/dev/null 2>&1 || { \
	  echo "error: '$(PYTHON)' not found. Install Python 3.11 or newer (Debian, Ubuntu: sudo apt-get install python3 python3-venv)." >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "error: '$(PYTHON)' is $$($(PYTHON) --version 2>&1); 3.11 or newer is needed. Install one (Ubuntu 22.04: sudo apt-get install python3.11 python3.11-venv) and run: make PYTHON=python3.11 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
	  v=$$($(PYTHON) -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])'); \
	  echo "error: '$(PYTHON)' cannot make virtual environments (module venv or ensurepip is missing). Debian, Ubuntu: sudo apt-get install python3-venv (or $$v)" >&2; exit 1; }
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
	@touch $@

$(INSTALLED): requirements.lock pyproject.toml $(CREATED)
	@$(BIN)/python -m fecontact.doctor --before --install
	@echo "Installing the locked packages (0.6 GB to download) into $(VENV) (several minutes the first time)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

setup: $(INSTALLED) ## make .venv from requirements.lock and check the system libraries
	@$(BIN)/python -m fecontact.doctor

demo: setup ## map where Hertz holds at six shifts, and solve an exact sphere; results in out/demo
	$(BIN)/fecontact demo --out out/demo

study: setup ## run the first study; results in out/first_light
	$(BIN)/fecontact run studies/first_light.py --out out/first_light

test: setup ## run the tests that are not slow
	@OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
	  $(BIN)/python -m pytest -q -n $(TEST_WORKERS) --dist worksteal -m "not slow"

test-slow: setup ## run the slow tests only
	@$(BIN)/python -m pytest -q -m slow

test-all: setup ## run the tests on the oldest and the newest supported Python of this machine, a few on the others
	@TEST_WORKERS=$(TEST_WORKERS) $(BIN)/python noxfile.py

dist: setup ## build wheel and sdist into dist/, and run each in a clean environment of each supported Python of this machine
	@rm -rf dist
	$(BIN)/uv build --quiet --no-build-isolation --python $(BIN)/python --out-dir dist
	$(BIN)/python -m nox --session dist

fresh-check: ## prove demo and installation on a minimal Debian 12 and 13 (root, debootstrap, network); skips elsewhere
	@.ci/fresh-check $(FRESH_CHECK)

# A study has a baseline if its CSV is there. All are compared before the target ends; old results are never taken for new.
regress: setup ## run the quick studies that have a baseline and compare each with it; results in out/regress
	@different=; for csv in studies/baselines/*.csv; do \
	  name=$$(basename "$$csv" .csv); out=out/regress/$$name; rm -rf "$$out"; echo "== $$name"; \
	  $(BIN)/fecontact run "studies/$$name.py" --quick --out "$$out"; \
	  $(BIN)/fecontact compare "$$csv" "$$out" --out "$$out" \
	    || different="$$different $$name"; \
	done; \
	if [ -n "$$different" ]; then echo "regress: not the same as the baseline:$$different" >&2; exit 1; fi; \
	echo "regress: all the same as their baselines"

validate: setup ## run the studies at full size and write studies/VALIDATION.md with its pages; one to two hours
	$(BIN)/fecontact validate --out out/validate --report studies/VALIDATION.md

docs: setup ## build the site of the documentation; results in out/site
	@PYTHONPATH="$(CURDIR)" OMP_NUM_THREADS=1 $(BIN)/python -m mkdocs build --strict -f studies/mkdocs.yml

# Debian's ParaView draws on a screen only: xvfb-run stands in for one. It must not begin anew when its last client
# leaves: ParaView tries a window first, and its next one would be refused meanwhile.
paraview-check: study ## open the first study in ParaView: read, integrate, see the whole ellipse; pictures in out/paraview
	@command -v pvpython >/dev/null 2>&1 || { \
	  echo "paraview-check: skipped, pvpython is not installed (Debian, Ubuntu: sudo apt-get install paraview xvfb xauth)"; exit 0; }; \
	$(BIN)/fecontact view out/first_light; \
	if [ -n "$$DISPLAY" ]; then set --; elif command -v xvfb-run >/dev/null 2>&1; then \
	  set -- xvfb-run -a -s "-screen 0 1280x1024x24 -noreset"; else \
	  echo "paraview-check: skipped, there is no screen and no xvfb-run (Debian, Ubuntu: sudo apt-get install xvfb xauth)"; exit 0; fi; \
	"$$@" pvpython tests/paraview_check.py out/first_light out/paraview

# Files a format, and the seed from which they are made.
FUZZ_COUNT ?= 20000
FUZZ_SEED ?= 1
# A folder of results that is damaged too, such as that of `make study`.
FUZZ_RESULTS ?= $(wildcard out/first_light)
fuzz: setup ## mutate profile files of every format, studies, vehicles, tolerances, baselines, results, fleets, command lines and paths; what is not clearly refused or read stays in fuzz_failures/; three hours
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_profiles.py --count $(FUZZ_COUNT) --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_results.py $(FUZZ_RESULTS) --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_inputs.py --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_commands.py --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/command_matrix.py --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_extremes.py --command solve --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_extremes.py --command hertz --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_extremes.py --command place --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_fleets.py --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" $(BIN)/python tests/fuzz_paths.py --solve --seed $(FUZZ_SEED)

crash: setup ## kill fleet commands at random times and run them again: equal tables, nothing left; half an hour
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 PYTHONPATH="$(CURDIR)" \
	  $(BIN)/python tests/crash_fleets.py --sample --seed $(FUZZ_SEED)

mutants: setup ## change one operator, constant or sign of the physics at a time and see whether a test notices; two hours
	PYTHONPATH="$(CURDIR)" $(BIN)/python tests/mutants.py

lint: $(INSTALLED) ## ruff check, ruff format --check, mypy; how large the program is
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m mypy
	@$(BIN)/python .ci/size.py fecontact

lock: $(CREATED) ## write requirements.lock again from pyproject.toml
	@test -x $(BIN)/uv || $(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(BIN)/uv pip compile pyproject.toml --extra dev --extra docs --universal --python-version 3.11 --generate-hashes \
	  --no-header --no-emit-index-url --no-emit-find-links --no-annotate -o requirements.lock

clean: ## remove .venv, caches and out/
	rm -rf $(VENV) out build dist .nox .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find fecontact tests studies -type d -name __pycache__ -prune -exec rm -rf {} +
