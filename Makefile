PYTHON ?= python3
BIN := .venv/bin
CORES ?= 2
BENCH := .venv-bench
# One thread a process: two processes share two cores well, two processes of two threads do not.
export OMP_NUM_THREADS = 1
export MKL_NUM_THREADS = 1
export NUMBA_NUM_THREADS = 1

.PHONY: run smoke test test-long lint docs-site bench clean

run: .venv/ready
	$(BIN)/snakemake --cores $(CORES)

smoke: .venv/ready
	$(BIN)/snakemake --cores $(CORES) --configfile config/smoke.yaml

test: .venv/ready lint
	$(BIN)/python -m pytest -n $(CORES) -m "not long"
	$(MAKE) smoke

test-long: .venv/ready
	$(BIN)/python -m pytest -n $(CORES)

lint: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow/Snakefile workflow/rules
	$(BIN)/snakemake --lint
	$(BIN)/mypy

docs-site: .venv/ready
	$(BIN)/python docs/site_of_docs.py

# Speed beside other programs, in an environment of its own: writes docs/benchmarks.md.
bench: $(BENCH)/ready
	RIPPLETWIN_BENCH_NUMPY1=$(CURDIR)/$(BENCH)/numpy1/bin/python $(BENCH)/bin/python benchmarks/bench.py

$(BENCH)/ready: environment.txt environment-bench.txt environment-bench-numpy1.txt pyproject.toml
	$(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip install --quiet --requirement environment-bench.txt
	$(PYTHON) -m venv $(BENCH)/numpy1
	$(BENCH)/numpy1/bin/python -m pip install --quiet --requirement environment-bench-numpy1.txt
	touch $@

.venv/ready: environment.txt pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --requirement environment.txt
	touch $@

clean:
	rm -rf .venv $(BENCH) .snakemake .site results
