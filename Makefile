# Two commands do everything: `make solve` and `make test`. The rest is for those who change the code.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# A quarter of all installed modules is ever imported: pip compiles none of them, and Python those, when it first does.
INSTALL := PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
export PYTHONDONTWRITEBYTECODE :=  # where it is set, every process would compile all that it imports anew
# A process of tests for each processor, each with one thread in torch, and most of a gigabyte of memory.
PARALLEL := -n logical --maxprocesses 8 --dist worksteal
CODE := pyproject.toml $(shell find problems allocators cli -name '*.py' -o -name '*.safetensors')
EXAMPLE := examples/earthquakes/alaska.json

.PHONY: solve test check format wheel docs policies clean

solve: $(VENV)/.installed  ## allocate the agents of a real instance with GAPPO, and draw the plan
	@mkdir -p out
	$(BIN)/alloc solve $(EXAMPLE) --method gappo --objective makespan-energy --output out/alaska-result.json --plot out/alaska.png

test: $(VENV)/.tested  ## run the tests but slow ones, on all processors; CI runs all of them
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest $(PARALLEL) -m 'not slow'

check: $(VENV)/.checked  ## lint, format, imports and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/mypy

format: $(VENV)/.checked  ## put the code into shape
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/.documented  ## build the documentation as a site in build/site, with warnings as errors
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict
	@echo "open build/site/index.html"

wheel: $(VENV)/.checked  ## build dist/*.whl
	rm -rf dist
	$(BIN)/python -m build --wheel --outdir dist .

# Decisions of agents that each shipped policy was trained on; the seed of all is 0.
METHODS := gappo ppo a2c dqn ddpg
STEPS_gappo := 1200000
STEPS_ppo := 250000
STEPS_a2c := 250000
STEPS_dqn := 150000
STEPS_ddpg := 120000
OPTIONS_gappo := --population 3 --set max_learning_rate=0.001

policies: $(METHODS:%=out/policies/%.safetensors)  ## train all shipped policies from nothing; `make -j 2 policies` on two cores
	@echo "to ship them: cp out/policies/*.safetensors allocators/learned/files/policies/"

out/policies/%.safetensors: | $(VENV)/.installed
	@mkdir -p out/policies/training
	$(BIN)/alloc train $* --steps $(STEPS_$*) $(OPTIONS_$*) --seed 0 --output out/policies/training/$*.safetensors \
	  $(if $(wildcard out/policies/training/$*.checkpoint),--resume)
	cp out/policies/training/$*.safetensors $@

clean:  ## remove what the other targets made
	rm -rf $(VENV) build dist out *.egg-info

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit("alloc needs Python 3.11 or newer; call make PYTHON=...") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --upgrade pip

$(VENV)/.installed: $(VENV)/bin/python $(CODE)
	$(INSTALL) --editable .
	$(BIN)/alloc methods --prepare
	@touch $@

# An installation anew makes compiled loops stale: on a fresh machine, one for the tests is all that they need, and
# what else is needed then comes without it.
$(VENV)/.tested: $(VENV)/bin/python $(CODE)
	$(INSTALL) --editable '.[test]'
	$(BIN)/alloc methods --prepare
	@touch $(VENV)/.installed $@

$(VENV)/.documented: $(VENV)/.installed
	$(INSTALL) 'alloc-mrta[docs]'
	@touch $@

$(VENV)/.checked: $(VENV)/.tested
	$(INSTALL) 'alloc-mrta[dev]'
	@touch $@
