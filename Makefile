# `make` alone prints this list. Every target does its own set-up (.ci/setup), instant when nothing changed.
BIN := .venv/bin
# A file stays with one process: kernels that only it needs are compiled once. tests/conftest.py orders the files.
# Two processes fill two cores: threads of the linear algebra would only wait for each other.
# Modules are compiled once and not by every process that a test starts, whatever the environment says.
PYTEST := PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -n 2 --dist loadfile --no-loadscope-reorder

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help demo study study-league report publish draw verify smoke test check lint docs links figures fuzz stress bench speeds \
	coverage clean distclean compiled \
	compiled-essential setup-run \
	setup-test setup-verify setup-dev FORCE

help: ## this list
	@echo "make TARGET"
	@awk -F ':.*## ' '/^[a-z%\/.-]+:.*## / {printf "  %-22s %s\n", $$1, $$2}' $(firstword $(MAKEFILE_LIST))
	@echo "Main studies: $$(grep -l main=True studies/catalog/*.py | xargs -n 1 basename -s .py | xargs)"

demo: setup-run ## squeeze a ball with three bodies: three numbers each, and a page (a minute)
	$(BIN)/organbench demo --results results/demo

study: setup-run ## run the main studies, then the charts and tables (the main job; minutes)
	$(BIN)/organbench run --report

study-%: setup-run ## run one study and draw it: make study-volume_loss
	$(BIN)/organbench run $*
	$(BIN)/organbench report $*

report: setup-run ## charts, tables and report.html, one page that opens anywhere, from the stored results
	$(BIN)/organbench report

study-league: setup-run ## all programs and ours on the open scenes of the league, each in an environment of its own (half an hour)
	$(BIN)/python -m studies.lab.league
	$(BIN)/organbench report

# What is current is skipped; so the same command goes on where it was interrupted.
publish: setup-verify compiled ## all that is published, again, by this machine (half a day; goes on where it was interrupted)
	$(BIN)/organbench run $$($(BIN)/python -c "import studies; print(*(study.name for study in studies.STUDIES))")
	$(BIN)/organbench run studies/lab/population/study.py
	$(BIN)/python -m studies.lab.population
	$(BIN)/python -m studies.lab.population.intervals results/population
	$(BIN)/python -m studies.lab.verify
	$(BIN)/organbench report --figures
	$(BIN)/python -m studies.lab.silicone
	$(BIN)/python -m studies.lab.silicone cylinder_press
	$(MAKE) fuzz
	$(BIN)/python -m studies.lab.league --sweep
	$(BIN)/python -m studies.lab.league
	$(BIN)/python -m studies.lab.silicone --programs
	$(BIN)/python -m studies.lab.silicone cylinder_press --programs
	$(BIN)/python -m studies.lab.publish
	$(BIN)/python -m studies.lab.methods_page

draw: setup-run ## ten published rows, drawn at random, run again and compared (minutes; SEED=7 repeats a draw)
	$(BIN)/python -m studies.lab.publish.draw $(if $(SEED),--seed $(SEED))

verify: setup-verify docs ## before a release: oracles, campaigns, browsers, clusters, wheels, notebooks (half an hour)
	$(BIN)/python -m studies.lab.verify
	$(PYTEST) -m "campaign or lab"

smoke: setup-run ## the main studies with their smallest settings: a quick check of the whole chain
	$(BIN)/organbench run --smoke

test: setup-test compiled ## every test but the campaigns and those of the lab, which `make verify` runs
	$(PYTEST) -m "not campaign and not lab"

# Asked for both, `make check test` leaves the fast tests to `test`.
check: lint links setup-dev ## lint, types, import contracts, links of the docs and the fast tests
	$(if $(filter test,$(MAKECMDGOALS)),,$(PYTEST) -m "not slow and not campaign and not lab")

lint: setup-dev ## ruff, pyright and the import contracts alone
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

docs: setup-dev compiled-essential ## the documentation as a site: open site/index.html; a broken link is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/python docs/site/build.py

links: setup-dev ## the same site in a minute, without running the notebooks
	NO_MKDOCS_2_WARNING=1 $(BIN)/python docs/site/build.py --links

fuzz: setup-run ## random trials that try to break every method (a quarter of an hour)
	$(BIN)/organbench fuzz --cases 10000

stress: # its name until version 0.2
	@echo "make stress is now make fuzz" >&2; exit 2

figures: setup-run ## draw the charts again from the stored results
	$(BIN)/organbench report --figures

bench: # its name until version 0.3
	@echo "make bench is now make speeds" >&2; exit 2

# asv takes the benchmarks of this commit and the code of either: OLD=v0.1 make speeds compares with a release.
OLD ?= HEAD~1
BENCH ?=
ASV = OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 $(BIN)/asv --config studies/lab/bench/asv.conf.json
speeds: setup-run ## the promised speeds of the last commit against those of OLD, by asv (quiet machine, please)
	$(BIN)/python -m pip install -q -c constraints.txt --no-build-isolation -e ".[bench]"
	$(ASV) machine --yes
	rm -rf build/asv/old && mkdir -p build/asv/old && git archive $(OLD) | tar -x -C build/asv/old
	export ASV_PYTHONPATH=$$PWD/build/asv/old; $(ASV) run --python=same --set-commit-hash $$(git rev-parse $(OLD)) $(BENCH)
	export ASV_PYTHONPATH=$$PWD; $(ASV) run --python=same --set-commit-hash $$(git rev-parse HEAD) $(BENCH)
	$(ASV) compare $$(git rev-parse $(OLD)) $$(git rev-parse HEAD)

coverage: setup-dev ## lines of the kernels that their tests run, with the compiler off
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m coverage run --source massspring/kernels -m pytest -q -m "not slow and not campaign and not lab" \
		tests/massspring/kernels
	$(BIN)/python -m coverage report --skip-covered --show-missing

# A chart or table by its file name: results/STUDY/NAME.png, results/STUDY/NAME.csv
results/%.png: setup-run FORCE ## one chart by its file name: make results/volume_loss/volume.png
	$(BIN)/organbench run $(firstword $(subst /, ,$*))
	$(BIN)/organbench report $(firstword $(subst /, ,$*))
	@test -f $@ || { echo "$@: this study draws no such chart; it has: $$(ls $(@D)/*.png)"; exit 2; }

results/%.csv: setup-run FORCE ## one table by its file name: make results/volume_loss/volume_loss.csv
	$(BIN)/organbench run $(firstword $(subst /, ,$*))
	$(BIN)/organbench table $(firstword $(subst /, ,$*)) --csv $@

clean: ## remove caches and unfinished files; results and .venv stay
	find . \( -name .venv -o -name .git \) -prune -o \( -name __pycache__ -o -name '*.egg-info' \) -type d -prune -exec rm -rf {} +
	rm -rf build dist site .pytest_cache .hypothesis .ruff_cache .import_linter_cache .numba_cache results/cache
	find . \( -name .venv -o -name .git \) -prune -o -name '*.part' -type f -exec rm -f {} +

distclean: clean ## clean, and remove .venv and the raw results too (charts and tables stay)
	rm -rf .venv
	test ! -d results || find results -name '*.h5' -type f -exec rm -f {} +

# Two processes that share what they compile, before two that would both compile it; says nothing when it is there.
compiled: setup-run
	@PYTHONDONTWRITEBYTECODE= $(BIN)/python -m studies.sweep.compiling.main

compiled-essential: setup-run
	@$(BIN)/python -m studies.sweep.compiling.main --essential

setup-run setup-test setup-verify setup-dev: setup-%:
	@.ci/setup $*

FORCE:
