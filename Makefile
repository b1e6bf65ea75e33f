# `make help` lists what there is. Needs Python 3.10 to 3.14, GNU make and a package index.
#   PYTHON=python3.12   the interpreter that makes the virtual environment
#   VENV=.venv          where the virtual environment lies
#   HASHES=1            install only files whose hashes stand in requirements/
#   FOR=core            the part that changed, for test-quick; core, a problem, baselines, agents, paper, tools or docs
#   ARGS="..."          more arguments for the command behind test, test-slow, train, kernels, bench and benchmark

VENV ?= .venv
ARGS ?=

ifeq ($(OS),Windows_NT)
PYTHON ?= python
BIN := $(VENV)/Scripts
else
PYTHON ?= python3
BIN := $(VENV)/bin
endif

PIP := $(BIN)/python -m pip install --no-input --disable-pip-version-check
INSTALL := $(PIP) --constraint constraints.txt
ONLY_OURS := $(PIP) --no-deps --no-build-isolation --editable .

# Stamps of what the environment holds. `all` includes `light`, `browser` includes both; all are renewed when their inputs change.
LIGHT := $(VENV)/.installed-light
ALL := $(VENV)/.installed-all
BROWSER := $(VENV)/.installed-browser

ZOO := agents/cps_agents/zoo/policies
DRY_RUN := $(findstring --dry-run,$(ARGS))

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help setup benchmark test test-quick test-slow test-browser screenshots demo train lint style types kernels bench peers census reliability pages verify docs clean clean-cache

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' Makefile

setup: $(ALL) ## install everything into the virtual environment and compile all kernels
	$(BIN)/cps-envs warm

benchmark: $(LIGHT) ## the main tables beside the paper's numbers, into results/; ARGS=--full for all (no torch)
	$(BIN)/cps-envs reproduce benchmark --out results $(ARGS)

# Problems whose kernels tests need: those of the package, and the test bed of the paper.
TESTED := disbanding fdi hvac rogue cps_paper.testbed.robots.problem:TESTBED
test: $(ALL) ## compile all kernels and run the tests
	@echo "make test: compile what is not compiled yet, once for all processes; 'make setup' does it ahead."
	$(BIN)/cps-envs --trust warm $(addprefix --problem ,$(TESTED))
	@echo "make test: pytest starts one process for each core and collects the tests; the first dot takes up to a minute."
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal $(ARGS)

# What a change in a part breaks first, each about 30 s of one core at most.
FOR ?= all
CHOICES := all core disbanding fdi hvac rogue baselines agents paper tools docs
quick = $(patsubst %,tests/$(1)/test_%.py,$(2))
game = $(call quick,$(1),$(2)) tests/test_golden.py -k $(1)
QUICK_all := $(call quick,core,rooms) $(call quick,core/declare,config fields) $(call quick,core/policies,lookup policy) \
  tests/test_golden.py tests/test_words.py tests/test_repository.py
QUICK_core := $(call quick,core,rooms) $(call quick,core/declare,config fields actions) $(call quick,core/game,match) \
  $(call quick,core/interfaces,environments reset_masks) $(call quick,core/policies,lookup mixture policy)
QUICK_disbanding := $(call game,disbanding,reference dynamics)
QUICK_fdi := $(call game,fdi,game model duel)
QUICK_hvac := $(call game,hvac,reference payoff config)
QUICK_rogue := $(call game,rogue,game reference pay)
QUICK_baselines := $(call quick,baselines,exhibit family tables)
QUICK_agents := $(call quick,agents,sheet evaluation_statistics league_equilibrium)
QUICK_paper := $(call quick,baselines,exhibit) $(call quick,agents,benchmark_tables)
QUICK_tools := $(call quick,tools,census mutation bench)
QUICK_docs := tests/test_words.py tests/test_repository.py tests/test_pages.py -k "not run"

test-quick: $(ALL) ## run what a change breaks first, below 30 s of one core; FOR=rogue names the part that changed
	$(if $(filter $(FOR),$(CHOICES)),,$(error FOR=$(FOR): there is no such part. Take one of $(CHOICES)))
	$(BIN)/python -m pytest -q $(QUICK_$(FOR)) $(ARGS)

test-slow: $(ALL) ## run only the tests marked slow
	$(BIN)/python -m pytest -m slow $(ARGS)

test-browser: $(BROWSER) ## drive Chromium through a report; needs chromium on this machine
	$(BIN)/python -m pytest -m browser $(ARGS)

screenshots: $(BROWSER) demo ## pictures of the report for the site, into docs/images
	$(BIN)/python -m tools.pages.screenshots build/extra/demo/index.html rogue/contested/monitor docs/images

demo: $(LIGHT) ## the report that the site shows, into build/extra/demo
	$(BIN)/cps-envs report --quick --out build/extra/demo

train: $(ALL) ## make every shipped network anew (hours; goes on where it stopped); ARGS=--dry-run lists the commands
	@sed -n 's/^  "command": "\(cps-envs .*\)",$$/\1/p' $(ZOO)/*.json | sort -ru | while read -r command; do \
		set -- $$command; \
		case $$2 in train) to="--out runs --to $(ZOO)";; *) to="--out runs/$$2-$$3";; esac; \
		echo "$$command --resume $$to"; \
		$(if $(DRY_RUN),,eval "$(BIN)/$$command --resume $$to $(ARGS)" < /dev/null || exit 1;) \
	done
	$(if $(DRY_RUN),,$(BIN)/python -m tools.pages)

lint: style types ## check style, format and types

style: $(ALL) ## check style and format only
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .

types: $(ALL) ## check types only
	$(BIN)/python -m mypy

kernels: $(LIGHT) ## build the wheel of compiled kernels, cps-envs-kernels, into dist (minutes); ARGS=--quick for few
	$(BIN)/python -m tools.kernels dist $(ARGS)

bench: $(LIGHT) ## measure the speed of environments and opponents
	$(BIN)/python -m tools.bench $(ARGS)

peers: $(ALL) ## try the packages of others on our wheel, into docs/peers.md (needs much disk)
	$(BIN)/python -m tools.peers $(ARGS)

census: $(LIGHT) ## how large the house is, beside how large it was to be; ARGS=--tests measures the quick tests
	$(BIN)/python -m tools.census $(ARGS)

reliability: $(ALL) ## try to break the package, into docs/reliability.md (goes on where it stopped)
	$(BIN)/python -m tools.reliability --publish $(ARGS)

pages: $(LIGHT) ## write the generated pages of docs/ anew
	$(BIN)/python -m tools.pages

SINCE ?= origin/main
verify: $(ALL) ## play every entry of leaderboard/ that this branch adds or changes, whole; SINCE=BRANCH to compare with
	$(BIN)/cps-envs --trust score verify --since $(SINCE)

docs: $(ALL) demo ## build the site, into build/site
	$(BIN)/python -m tools.pages
	$(BIN)/python -m sphinx -W --keep-going -b html docs build/site
	@echo "Open build/site/index.html"

clean: clean-cache ## remove what can be rebuilt, the virtual environment too; keeps results/ and runs/
	rm -rf $(VENV) build dist .coverage htmlcov .hypothesis .mypy_cache .pytest_cache .ruff_cache

clean-cache: ## remove numba's compiled kernels (see CONTRIBUTING.md)
	find cps_envs baselines agents paper tools tests \( -name '*.nbi' -o -name '*.nbc' \) -exec rm -f {} +

$(VENV)/pyvenv.cfg:
	$(PYTHON) -m venv $(VENV)

$(LIGHT): pyproject.toml constraints.txt | $(VENV)/pyvenv.cfg
ifdef HASHES
	$(PIP) --require-hashes --no-deps --requirement requirements/light.txt
	$(ONLY_OURS)
else
	$(INSTALL) --editable ".[cli,baselines,genetic,render]"
endif
	@touch $@

$(ALL): pyproject.toml constraints.txt | $(VENV)/pyvenv.cfg
ifdef HASHES
	$(PIP) --require-hashes --no-deps --requirement requirements/all.txt
	$(ONLY_OURS)
else
	$(INSTALL) --upgrade "pip>=25.1"
	$(INSTALL) --editable ".[all]" --group dev
endif
	@touch $(LIGHT) $@

$(BROWSER): $(ALL)
	$(INSTALL) --group browser
	@touch $@
