PYTHON ?= python3
BIN := .venv/bin
CORES ?= 2
BENCH := .venv-bench
# Per cent of lines and branches in src that the fast tests run at least.
LEAST_COVERAGE := 87
# Processes take tests in the order of the files, not by turns: most of what a file prepares is prepared once.
SHARED_OUT = -n $(CORES) --dist worksteal
# One thread a process: two processes share two cores well, two processes of two threads do not.
export OMP_NUM_THREADS = 1
export MKL_NUM_THREADS = 1
export NUMBA_NUM_THREADS = 1
# A run is a hundred processes: none compiles again what another one has compiled, whatever the environment says.
export PYTHONDONTWRITEBYTECODE =

.PHONY: run smoke test test-long coverage mutants fuzz lint docs-site bench pins audit clean

run: .venv/ready
	$(BIN)/snakemake --cores $(CORES)

smoke: .venv/ready
	$(BIN)/snakemake --cores $(CORES) --configfile config/smoke.yaml

# The smoke run comes first: it compiles once what each process that runs tests would compile for itself.
test: .venv/ready lint smoke
	$(BIN)/python -m pytest $(SHARED_OUT) -m "not long"

test-long: .venv/ready
	$(BIN)/python -m pytest $(SHARED_OUT)

# Lines and branches that the fast tests run; TESTS=tests/case names one room. All rooms together may not fall below
# LEAST_COVERAGE.
coverage: .venv/ready
	mkdir -p .coverage
	$(BIN)/python -m pytest $(SHARED_OUT) -m "not long" --cov --cov-report=term --cov-report=html:.coverage/html \
	  --cov-fail-under=$(if $(TESTS),0,$(LEAST_COVERAGE)) $(TESTS)

# Faults put into the verdict's rules, the scoring and the readers, one at a time: what share the tests notice.
mutants: .venv/ready
	$(BIN)/python benchmarks/mutants.py

# Inputs of every reader, guided by the branches that they reach; what is found is kept in fuzz_found.
INPUTS ?= 10000
fuzz: .venv/ready
	$(BIN)/python -m pip install --quiet --editable ".[fuzz]"
	$(BIN)/python tests/fuzz/guided.py --inputs $(INPUTS) --corpus .fuzz

lint: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow/Snakefile workflow/rules
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

# The newest version of every package that pyproject.toml allows, as the new environment.txt.
pins:
	rm -rf .venv-pins
	$(PYTHON) -m venv .venv-pins
	.venv-pins/bin/python -m pip install --quiet ".[dev]"
	echo "# Every package of the environment, pinned; the last line installs the project itself." > .venv-pins/pins
	.venv-pins/bin/python -m pip freeze --exclude rippletwin >> .venv-pins/pins
	echo "-e ." >> .venv-pins/pins
	mv .venv-pins/pins environment.txt
	rm -rf .venv-pins

# Known vulnerabilities of the pinned packages; asks the package index.
audit:
	$(PYTHON) -m venv .venv-audit
	.venv-audit/bin/python -m pip install --quiet pip-audit
	grep -v "^-e" environment.txt > .venv-audit/pins
	.venv-audit/bin/pip-audit --requirement .venv-audit/pins --no-deps --disable-pip

clean:
	rm -rf .venv .venv-* .snakemake .site .coverage .fuzz fuzz_found results
