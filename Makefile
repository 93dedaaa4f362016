# Two commands do everything: `make solve` and `make test`. The rest is for those who change the code.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := PYTHONWARNINGS=ignore $(BIN)/python -m pip --quiet --disable-pip-version-check
CODE := pyproject.toml $(shell find problems allocators cli -name '*.py' -o -name '*.safetensors')
EXAMPLE := examples/earthquakes/alaska.json

.PHONY: solve test check format wheel clean

solve: $(VENV)/.installed  ## allocate the agents of a real instance with GAPPO, and draw the plan
	@mkdir -p out
	$(BIN)/alloc solve $(EXAMPLE) --method gappo --objective makespan-energy --output out/alaska-result.json --plot out/alaska.png

test: $(VENV)/.tested  ## run the tests
	$(BIN)/python -m pytest

check: $(VENV)/.checked  ## lint, format and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/.checked  ## put the code into shape
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

wheel: $(VENV)/.checked  ## build dist/*.whl
	rm -rf dist
	$(BIN)/python -m build --wheel --outdir dist .

clean:  ## remove what the other targets made
	rm -rf $(VENV) build dist out *.egg-info

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit("alloc needs Python 3.11 or newer; call make PYTHON=...") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(PIP) install --upgrade pip

$(VENV)/.installed: $(VENV)/bin/python $(CODE)
	$(PIP) install --editable .
	$(BIN)/alloc methods --prepare
	@touch $@

$(VENV)/.tested: $(VENV)/.installed
	$(PIP) install --editable '.[test]'
	@touch $@

$(VENV)/.checked: $(VENV)/.tested
	$(PIP) install --editable '.[dev]'
	@touch $@
