# `make` alone lists the targets. Settings: PYTHON (the interpreter of a new environment), VENV (where it goes),
# ARGS (for the command of a target), DEATHS and ENDINGS (real hosts of each way in `make faults`), WITH_UV (a uv that
# is there already: it makes a further environment in half of the time that pip takes).

PYTHON ?= python3
VENV ?= .venv
ARGS ?=
WITH_UV ?=
DEATHS ?= 30
ENDINGS ?= 10

BIN = $(VENV)/bin
PIP = $(BIN)/python -m pip -qq --disable-pip-version-check --no-input
# The lock names all there is. --no-deps: pip takes exactly that, and looks for no newer version of anything.
INSTALLER = $(if $(WITH_UV),$(WITH_UV) --quiet pip install --compile-bytecode --python $(BIN)/python,$(PIP) install)
INSTALL = $(INSTALLER) --no-deps --require-hashes --only-binary :all: -r
EDITABLE = $(INSTALLER) --no-deps --no-build-isolation --editable .
COMPILE = $(BIN)/uv --quiet pip compile --universal --no-strip-extras --fork-strategy fewest --python-version 3.11 --generate-hashes \
	--no-emit-index-url --no-emit-find-links --custom-compile-command "make lock" pyproject.toml --group build
PYTEST = $(BIN)/python -m pytest -n 2

RUN = $(VENV)/.installed-run
DEV = $(VENV)/.installed-dev

# Shell variables and pip.conf have no effect on the environment.
unexport PYTHONPATH PYTHONHOME
export PIP_USER = 0

.DELETE_ON_ERROR:
.PHONY: help run test check quick format generate pytest faults fuzz limits mutants firmware chip bench soak soak-long encoders pictures reversal walk numbers panel-hour chatter stop-bars lock lockcheck clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

run: $(RUN) ## the simulated rig with its dashboard; ARGS="--help" for what else it takes
	@$(BIN)/dcmp-hil run bench-1khz $(ARGS)

test: check ## every check, then every test with coverage
	@echo "Testing, with coverage ..."
	@$(PYTEST) --cov --cov-report=term-missing $(ARGS)

check: $(DEV) ## style, format, types, import contracts
	@echo "Checking style ..."
	@$(BIN)/ruff check
	@echo "Checking format ..."
	@$(BIN)/ruff format --check
	@echo "Checking types ..."
	@$(BIN)/mypy
	@echo "Checking import contracts ..."
	@$(BIN)/lint-imports --no-logo

quick: check ## what a commit needs: every check, and the tests that are not slow
	@$(PYTEST) -q -m "not slow" $(ARGS)

format: $(DEV) ## bring the code into its format, and mend what ruff can mend
	@$(BIN)/ruff check --fix
	@$(BIN)/ruff format

generate: $(DEV) ## write again what is made from the DBC, from the rig's tables and from the boards
	@$(BIN)/python -m tools.protocol
	@$(BIN)/python -m tools.boards
	@$(BIN)/python -m tools.schema
	@$(BIN)/python -m tools.traces

pytest: $(DEV) ## every test, without checks or coverage
	@$(PYTEST) $(ARGS)

faults: $(DEV) ## 100 kinds of fault x 100 seeds, 1,000 healthy runs, 170 real hosts that end; tables in reports/
	@mkdir -p reports
	@failed=0; \
	$(BIN)/python -m tools.faults --seeds 100 --healthy 1000 \
		--markdown reports/faults.md --json reports/faults.json $(ARGS) || failed=1; \
	$(BIN)/python -m tools.host_death --n $(DEATHS) \
		--markdown reports/host-death.md --json reports/host-death.json || failed=1; \
	$(BIN)/python -m tools.host_endings --n $(ENDINGS) \
		--markdown reports/host-endings.md --json reports/host-endings.json || failed=1; \
	exit $$failed

fuzz: $(DEV) ## 10 million executions of the firmware's core beside its model, and every branch of it reached
	@$(BIN)/python -m tools.fuzz $(ARGS)

mutants: $(DEV) ## break the safety C piece by piece: a test notices, or tests/firmware/mutants.toml says why not
	@$(BIN)/python -m tools.mutants $(ARGS)

firmware: $(DEV) ## build the boards with a chip into dist/firmware: ELF, images, maps, hashes; ARGS="--boards FOLDER" for boards of one's own
	@$(BIN)/python -m tools.artefact $(ARGS)

chip: $(DEV) ## the law in single precision on an emulated Cortex-M4: a million samples of each part to the bit, and what a step costs
	@DCMP_CHIP_SAMPLES=1000000 $(BIN)/python -m pytest -n 0 -q tests/target/test_chip.py tests/target/test_chip_loop.py $(ARGS)

numbers: $(DEV) ## type 1,000 random numbers into rig.toml and `set`: no simulated arm leaves its limits
	@$(BIN)/python -m tools.typed_numbers $(ARGS)

walk: $(DEV) ## every command in every combination of its options and outputs; CI asks every pair of options and every output
	@DCMP_WALK=all $(BIN)/python -m pytest tests/walk $(ARGS)

panel-hour: $(DEV) ## push an hour of states into the panel's page in a browser: its memory stays flat
	@DCMP_PANEL_S=3600 $(BIN)/python -m pytest -n 0 -q -k memory tests/panel/test_page.py $(ARGS)

chatter: $(DEV) ## 1,000 healthy arms and the hard cases: how near their voltage comes to being called chatter
	@$(BIN)/python -m tools.chatter $(ARGS)

soak: $(DEV) ## an hour of `dcmp-hil run` by the wall clock, with everything on: memory stays flat, nothing is lost
	@$(BIN)/python -m tools.soak --real --minutes 60 $(ARGS)

soak-long: $(DEV) ## eight hours of data by rate through the real processes
	@$(BIN)/python -m tools.soak --minutes 480 $(ARGS)

limits: $(DEV) ## wrong observers of six kinds against speed limits, 1,000 healthy arms: the table of docs/safety.md
	@$(BIN)/python -m tools.limits $(ARGS)

pictures: $(DEV) ## draw the dashboard running and tripped, native and web, at three sizes, into reports/pictures; ARGS=--readme for docs/images
	@$(BIN)/python -m tools.pictures $(ARGS)

reversal: $(DEV) ## draw a reversal as every observer sees it, the picture of docs/observers.md
	@$(BIN)/python -m tools.reversal $(ARGS)

encoders: $(DEV) ## healthy runs and reaction times by encoder and rate: the tables of docs/safety.md
	@$(BIN)/python -m tools.encoders $(ARGS)

stop-bars: $(DEV) ## STOP against controllers that are bad to their run, 100 each; ARGS="--n 10 --jobs 2"
	@$(BIN)/python -m tools.stop_bars $(ARGS)

bench: $(DEV) ## measure, print a table
	@$(BIN)/python -m tools.bench $(ARGS)

lock: | $(BIN)/uv ## pin again after a change in pyproject.toml; ARGS=--upgrade for newer versions
	@echo "Pinning the dependencies ..."
	@$(COMPILE) --extra plot --extra panel --extra sweep --output-file requirements.txt $(ARGS)
	@$(COMPILE) --extra plot --extra panel --extra sweep --extra cluster --extra dev \
		--constraints requirements.txt --output-file requirements-dev.txt $(ARGS)

lockcheck: $(DEV) ## the locks have a wheel of everything for each Python from 3.11 to 3.14; asks the index
	@for version in 3.11 3.12 3.13 3.14; do for lock in requirements.txt requirements-dev.txt; do \
		$(BIN)/uv --quiet pip install --dry-run --python-version $$version --python-platform linux --target build/none \
			--no-deps --require-hashes --only-binary :all: -r $$lock || exit 1; \
		echo "$$lock: complete for Python $$version"; done; done

clean: ## remove the environment, caches and reports; recordings in runs/ stay
	@rm -rf $(if $(wildcard $(VENV)/pyvenv.cfg),$(VENV)) .venv-* build dist htmlcov reports .coverage .coverage.* \
		.hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	@find dcmp_hil sim_backend tests tools -name __pycache__ -type d -prune -exec rm -rf {} +

# pip comes last into a new environment, so it is the sign of a complete one.
$(BIN)/pip:
	@"$(PYTHON)" --version >/dev/null 2>&1 || \
		{ echo "There is no working $(PYTHON) here: install Python 3.11 or newer, or say make PYTHON=/path/to/python3." >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "$$("$(PYTHON)" --version) is too old: Python 3.11 or newer is needed, say make PYTHON=/path/to/python3.11." >&2; exit 1; }
	@"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null || \
		{ echo "$(PYTHON) cannot make virtual environments, which Debian and Ubuntu package apart: apt install python3-venv" >&2; exit 1; }
	@echo "Making the environment $(VENV) with $$("$(PYTHON)" --version) ..."
	@"$(PYTHON)" -m venv $(VENV)

$(RUN): requirements.txt pyproject.toml | $(BIN)/pip
	@echo "Installing what the rig needs into $(VENV) (a minute or two the first time) ..."
	@$(INSTALL) requirements.txt
	@$(EDITABLE)
	@touch $@

$(DEV): requirements-dev.txt pyproject.toml | $(BIN)/pip
	@echo "Installing what the tests need into $(VENV) (a minute or two the first time) ..."
	@$(INSTALL) requirements-dev.txt
	@$(EDITABLE)
	@touch $(RUN) $@

$(BIN)/uv: | $(BIN)/pip
	@$(INSTALL) requirements-dev.txt
