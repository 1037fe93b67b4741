PYTHON ?= python3
BIN := .venv/bin
CORES ?= 2
# One thread a process: two processes share two cores well, two processes of two threads do not.
export OMP_NUM_THREADS = 1
export MKL_NUM_THREADS = 1
export NUMBA_NUM_THREADS = 1

.PHONY: run smoke test test-long lint docs-site pins audit clean

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
	rm -rf .venv .venv-audit .venv-pins .snakemake .site results
