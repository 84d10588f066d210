# make demo     say what will be installed, build, render, write pictures into out/, print a table
# make test     build and run the tests; LIXEL_DEVICE=gpu make test runs those of the shaders, too
# make lint     formatting, lints and types
# make fmt      format everything
# make coverage line coverage by the tests, in out/coverage/coverage.csv
# make docs     the documentation as a site in out/docs
# make wheel    a wheel and a source distribution in dist/
# make clean    remove what the others made

PYTHON ?= python3
VENV := $(CURDIR)/.venv
BIN := $(VENV)/bin
OUT ?= out
# Processes that test side by side: each renders on all cores, but waits for itself half of the time.
TESTERS ?= 2

# pyo3 asks this Python what to link against.
export PYO3_PYTHON := $(BIN)/python
export VIRTUAL_ENV := $(VENV)
unexport CONDA_PREFIX
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: demo announce test coverage lint fmt docs wheel clean setup setup-test build
.NOTPARALLEL:

demo: announce setup $(VENV)/.installed build
	$(BIN)/lixel demo --out $(OUT)

announce:
	@echo "make demo installs"
	@echo "  for the system: $$(PYTHON=$(PYTHON) .ci/setup build list)"
	@echo "  into $(VENV): maturin and lixel, with the Python packages that pyproject.toml names"
	@echo "  into $(CURDIR)/target: what cargo builds, with the crates that Cargo.lock names"
	@echo "and writes pictures into $(OUT)/. make clean removes all but what the system got."

test: export LIXEL_DEVICE := $(or $(LIXEL_DEVICE),cpu)
test: setup-test $(VENV)/.installed-$(if $(LIXEL_BROWSER),browser,test) build
	LD_LIBRARY_PATH="$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_config_var("LIBDIR"))')" \
	  cargo test --locked $(if $(filter-out cpu,$(LIXEL_DEVICE)),-- --include-ignored)
	$(BIN)/python -m pytest --numprocesses=$(TESTERS) --dist=loadfile

coverage: setup-test $(VENV)/.installed-test
	$(BIN)/python tests/tools/measure_coverage.py

lint: setup-test $(VENV)/.installed-test build
	cargo fmt --check
	cargo clippy --locked --all-targets -- -D warnings
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict python/lixel
	$(BIN)/python -m mypy.stubtest --mypy-config-file pyproject.toml lixel._core

fmt: $(VENV)/.installed-test
	cargo fmt
	$(BIN)/ruff check --fix-only .
	$(BIN)/ruff format .

docs: setup-test $(VENV)/.installed-test build
	$(BIN)/mkdocs build --strict --quiet --config-file docs/mkdocs.yml

wheel: setup $(VENV)/.maturin
	$(BIN)/maturin build --release --locked --strip --sdist --out dist

clean:
	rm -rf target dist out .venv .hypothesis .mypy_cache .pytest_cache .ruff_cache
	rm -f python/lixel/*.so
	find python tests -name __pycache__ -prune -exec rm -rf {} +

setup:
	@PYTHON=$(PYTHON) .ci/setup

setup-test:
	@PYTHON=$(PYTHON) .ci/setup test

# Only the extension module, in place: the rest of the package is used from python/.
build:
	$(BIN)/maturin develop --release --locked --skip-install --quiet

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/.maturin: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet 'maturin>=1.9.4,<2'
	@touch $@

$(VENV)/.installed: pyproject.toml $(VENV)/.maturin
	$(BIN)/maturin develop --release --locked
	@touch $@

$(VENV)/.installed-test: pyproject.toml $(VENV)/.maturin
	$(BIN)/maturin develop --release --locked --extras test
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-browser: pyproject.toml $(VENV)/.maturin
	$(BIN)/maturin develop --release --locked --extras test,browser
	@touch $@ $(VENV)/.installed-test $(VENV)/.installed
