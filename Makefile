# Needs git, make and Python 3.11 or newer; everything else is installed from uv.lock into .venv.
# Choose another interpreter with `make PYTHON=python3.12 ...`. Paths are relative, so that any folder name works.

UV_VERSION = 0.13.9
READY = .venv/.ready
PY = .venv/bin/python

# The tools that the stages start are those of .venv, whatever the caller's environment holds.
IN_VENV = env -u VIRTUAL_ENV -u PYTHONPATH -u PYTHONHOME PATH="$(CURDIR)/.venv/bin:$$PATH"

export UV_PROJECT_ENVIRONMENT = .venv
export UV_PYTHON_DOWNLOADS = never
export PIP_DISABLE_PIP_VERSION_CHECK = 1
export PYTHONUTF8 = 1

.PHONY: licences help repro compare flow up down status test study bench docs lint
.DEFAULT_GOAL := help

help:
	@echo 'make repro   set up, reproduce every stage that is out of date (dvc repro), print Table 6.1'
	@echo 'make compare reproduce, hold the results against the committed ones (REV=COMMIT: those of another commit)'
	@echo 'make flow    the same as a Prefect flow, with its artifacts'
	@echo 'make up      start Prefect server, MLflow server and worker here, make the deployments, print the addresses'
	@echo 'make down    end what make up started'
	@echo 'make status  what of it runs'
	@echo 'make test    set up, run all tests on all processors; what was left out is named at the end'
	@echo 'make study   set up, reproduce the larger comparisons of studies/dvc.yaml and what they depend on'
	@echo 'make bench   set up, measure speed and memory, write benchmarks/results.json (FULL=1: whole pipeline, too)'
	@echo 'make docs    set up, build the documentation into site/ (open site/index.html)'
	@echo 'make licences print package, version and licence of everything that is installed, as CSV'
	@echo 'make lint    set up, check style (ruff) and types (mypy)'

repro: $(READY)
	@$(IN_VENV) $(PY) -m flows.dvc_lock
	@$(IN_VENV) $(PY) -m dvc repro
	@$(IN_VENV) $(PY) -m stages.show_table

compare: $(READY)
	@$(IN_VENV) $(PY) -m flows.dvc_lock
	@$(IN_VENV) $(PY) -m dvc repro
	@$(IN_VENV) $(PY) -m reproduction.compare $(REV)

flow: $(READY)
	@$(IN_VENV) $(PY) -m flows.pipeline
	@$(IN_VENV) $(PY) -m stages.show_table

up down: $(READY)
	@$(IN_VENV) $(PY) -m flows.desk $@

status: $(READY)
	@$(IN_VENV) $(PY) -m flows.desk status || test $$? -eq 3

test: $(READY)
	@$(IN_VENV) $(PY) -m pytest -q -n auto

study: $(READY)
	@$(IN_VENV) $(PY) -m flows.dvc_lock
	@$(IN_VENV) $(PY) -m dvc repro studies/dvc.yaml

bench: $(READY)
	@$(IN_VENV) $(PY) -m benchmarks $(if $(FULL),--full)

docs: $(READY)
	@$(IN_VENV) NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --clean

licences: $(READY)
	@$(IN_VENV) $(PY) -m reproduction.licences

lint: $(READY)
	$(IN_VENV) $(PY) -m ruff check .
	$(IN_VENV) $(PY) -m ruff format --check .
	$(IN_VENV) $(PY) -m mypy

# A downloaded archive has no Git: DVC is told so once.
ifeq ($(wildcard .git),)
repro compare flow study up: .dvc/config.local
.dvc/config.local:
	@printf '[core]\n    no_scm = true\n' > $@
endif

# The stamp names the folder: a checkout that was moved gets a new environment, as scripts in .venv/bin hold its path.
ifneq ($(shell cat $(READY) 2>/dev/null),$(CURDIR))
.PHONY: $(READY)
endif

# Keep a .venv that works, else make one; let the pinned uv install what uv.lock says. The stamp is written last.
# Compiled once here, packages load in half the time, also where Python may not write bytecode.
$(READY): uv.lock pyproject.toml
	@set -e; usable='import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))'; \
	if [ -e $(READY) ] && [ "$$(cat $(READY))" != "$(CURDIR)" ]; then rm -rf .venv; fi; \
	if ! $(PY) -c "$$usable" 2>/dev/null; then \
	  rm -rf .venv; found=''; \
	  for python in $(PYTHON) python3 python3.14 python3.13 python3.12 python3.11; do \
	    if "$$python" -c "$$usable" 2>/dev/null; then found=$$python; break; fi; \
	  done; \
	  if [ -z "$$found" ]; then \
	    echo 'robojoule needs Python 3.11 or newer with its venv module (Debian, Ubuntu: apt install python3-venv).' >&2; \
	    echo "python3 here: $$(python3 --version 2>&1). Name another one with: make PYTHON=/path/to/python3" >&2; exit 1; \
	  fi; \
	  echo "Setting up .venv with $$("$$found" --version) ..."; \
	  "$$found" -m venv .venv; \
	fi; \
	$(PY) -m pip --version >/dev/null 2>&1 || $(PY) -m ensurepip >/dev/null; \
	$(IN_VENV) $(PY) -m pip install --quiet 'uv==$(UV_VERSION)'; \
	$(IN_VENV) .venv/bin/uv sync --quiet --frozen --all-extras --all-groups --compile-bytecode; \
	printf '%s\n' "$(CURDIR)" > $(READY)
