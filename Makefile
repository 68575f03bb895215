# Two commands matter: `make demo` and `make test`. Everything lives in .venv; nothing else on the machine is changed, except that as
# root on Debian the shared libraries that open3d loads are installed where they are missing.
VENV ?= .venv
RUN ?= runs/demo
WORKERS ?= 2
TESTERS ?= 4
# Processes beside mypy's own
TYPE_CHECKERS ?= 2
BIN = $(VENV)/bin
export OMP_NUM_THREADS = 1
export OPENBLAS_NUM_THREADS = 1
export MKL_NUM_THREADS = 1
# Every run starts many interpreters: without bytecode each would translate all libraries again, which takes seconds
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test check lint types layers spelling docs evidence view-bundle clean

demo: $(VENV)/.runtime
	$(BIN)/cityflow demo --out $(RUN) --workers $(WORKERS)

# Two processes more than cores, since those with a cluster mostly wait for it. Which tests stay in one process: tests/shared_processes.py
test: $(VENV)/.dev
	$(BIN)/pytest -q -n $(TESTERS) --dist loadfile --no-loadscope-reorder

check: lint types layers spelling docs

lint: $(VENV)/.dev
	$(BIN)/ruff check src tests benchmarks notebooks
	$(BIN)/ruff format --check src tests benchmarks notebooks

# Two processes must find each other within seconds, which they do not on a machine under load; then one does it
types: $(VENV)/.dev
	$(BIN)/mypy --num-workers $(TYPE_CHECKERS) || $(BIN)/mypy

layers: $(VENV)/.dev
	$(BIN)/lint-imports

spelling: $(VENV)/.dev
	$(BIN)/codespell src docs README.md ARCHITECTURE.md CHANGELOG.md CONTRIBUTING.md

# The documentation as a site, in build/site; a link that leads nowhere fails
docs: $(VENV)/.dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# The figures of the five papers beside ours, measured here; hours for all rows (cityflow bench --list)
evidence: $(VENV)/.dev
	$(BIN)/cityflow bench

# The page of `cityflow view` from its sources in view/; wants node and npm. A test compares what is committed with what this makes
view-bundle:
	cd view && npm ci --no-audit --no-fund && npm run build

$(VENV)/.installed: pyproject.toml constraints.txt deploy/setup.sh
	sh deploy/setup.sh $(VENV)
	touch $@

# PYTHONPATH: the package is installed once more meanwhile, where make has several jobs
$(VENV)/.runtime: $(VENV)/.installed deploy/compile.py
	@echo "Compiling once (a minute)"
	PYTHONPATH=src $(BIN)/python deploy/compile.py
	touch $@

$(VENV)/.tools: $(VENV)/.installed
	sh deploy/setup.sh $(VENV) dev
	touch $@

$(VENV)/.dev: $(VENV)/.runtime $(VENV)/.tools
	touch $@

clean:
	rm -rf $(VENV) runs build dist view/node_modules .mypy_cache .ruff_cache .pytest_cache
