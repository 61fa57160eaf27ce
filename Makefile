# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0

PYTHON ?= python3
DEMO_ARGS ?=
BENCHMARK_ARGS ?=
SOAK_ARGS ?=
PYTEST_ARGS ?=
MATRIX_ARGS ?=
FUZZ_ARGS ?=

venv := .venv
python := $(venv)/bin/python
# Errors alone: pip warns of each place of packages that is set but not there, once a package.
pip_install := $(python) -m pip install --quiet --quiet
# Images of containers often forbid it; processes then compile the same sources at each start.
export PYTHONDONTWRITEBYTECODE :=
# Else xdist waits for ever for what a process that crashed has left.
parallel := --dist loadfile --max-worker-restart 0 --numprocesses

ros_is_sourced := $(shell [ "$$ROS_DISTRO" = jazzy ] && [ -n "$$AMENT_PREFIX_PATH" ] \
	&& $(PYTHON) -c 'import rclpy' 2>/dev/null && echo yes)

ifeq ($(ros_is_sourced),yes)
ros := installed
venv_options := --system-site-packages
requirements := $(addprefix requirements/,runtime.txt demo.txt bags.txt cluster.txt \
	completion.txt evaluate.txt video.txt test.txt)
export AMENT_PREFIX_PATH := $(CURDIR)/$(venv):$(AMENT_PREFIX_PATH)
else
ros := wheels
venv_options :=
requirements := $(addprefix requirements/,runtime.txt ros.txt demo.txt bags.txt cluster.txt \
	completion.txt evaluate.txt video.txt test.txt)
export AMENT_PREFIX_PATH := $(CURDIR)/$(venv)
export RMW_IMPLEMENTATION := rmw_fastrtps_cpp
# Left over from another environment these would hide the wheels.
unexport PYTHONPATH LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
endif

# Without bytecode, the modules and the assertions of all tests are compiled in each process anew.
unexport PYTHONDONTWRITEBYTECODE

dependencies_installed := $(venv)/.dependencies-$(ros)
package_installed := $(venv)/.package-$(ros)
sphinx_installed := $(venv)/.sphinx-$(ros)
tox_installed := $(venv)/.tox-$(ros)
linted := $(venv)/.linted
kernels_compiled := $(venv)/.kernels
sources := $(shell find bench docs fuzzy_stereo_ros launch test -name '*.py') setup.py
# Interpreters that pyenv has, each in a folder of its own.
pyenv_pythons := $(wildcard $(or $(PYENV_ROOT),$(HOME)/.pyenv)/versions/*/bin)

# empty and space: what make needs to join words by colons.
empty :=
space := $(empty) $(empty)

.PHONY: help demo test test-all test-rest soak fuzz benchmark matrix docs lint clean

help:
	@echo 'make demo   the node on a window that pans over one real pair: a table, a picture'
	@echo "            make demo DEMO_ARGS='--profile paper --population 40 --generations 10'"
	@echo 'make test   ruff, flake8, pep257, then the tests that take minutes in all'
	@echo 'make test-all  every test, nodes, processes, builds, fuzz and soak in short among them'
	@echo "            make test-all PYTEST_ARGS='test/ros/test_stereo_node.py -x'"
	@echo 'make test-rest  what make test-all has and make test has not'
	@echo 'make fuzz   the fuzz tests of make test-all with a hundred times the examples, others each'
	@echo '            time, and with the bounds of every index checked: hours'
	@echo "            make fuzz FUZZ_ARGS='test/fuzz/test_fuzz_messages.py -x'; in half an hour, with"
	@echo '            twenty times the examples: make fuzz FUZZ_TIMES=20'
	@echo 'make soak   the node for an hour with faults from a seed: what it promises, kept or broken'
	@echo "            make soak SOAK_ARGS='--minutes 5 --seed 2 --verbose'"
	@echo 'make benchmark  all benchmarks, one after the other, into docs/benchmarks.md: hours'
	@echo "            make benchmark BENCHMARK_ARGS='--quick --output /tmp/page.md'"
	@echo 'make matrix the suite on each Python that is there, with the newest of all and with'
	@echo '            what Ubuntu 24.04 has, and matches on an emulated aarch64:'
	@echo '            make matrix MATRIX_ARGS="-e 3.12 -- -x"'
	@echo 'make docs   the pages and what stands in docstrings, into docs/_build'
	@echo 'make lint   ruff, flake8 and pep257 alone'
	@echo 'make clean  remove what was made: $(venv), builds and caches'
	@echo
	@echo 'The first run makes $(venv) with $(PYTHON) (choose with PYTHON=...), ROS from: $(ros)'

demo: $(package_installed)
	$(python) -m bench.demo $(DEMO_ARGS)

test: lint $(kernels_compiled)
	$(python) -m pytest -m 'not slow' $(parallel) logical $(PYTEST_ARGS)

# Two processes that compile the same kernels take as long as one: they are compiled before.
$(kernels_compiled): $(package_installed) $(filter fuzzy_stereo_ros/matching/%,$(sources))
	for profile in realtime quality paper; do \
		$(python) -m fuzzy_stereo_ros.commands.command_line warm-up --profile $$profile || exit; done
	touch $@

# Files are taken in their order, in which the longest, of fuzz, are among the first ones. One
# process more than there are cores: most of the time a test of nodes waits for their answers.
test-rest: docs
	$(python) -m pytest -m 'slow and not alone' $(parallel) $$(($$(nproc) + 1)) \
		--no-loadscope-reorder $(PYTEST_ARGS)
	$(python) -m pytest -m 'slow and alone' $(PYTEST_ARGS)

test-all: lint docs
	$(python) -m pytest $(PYTEST_ARGS)

fuzz: $(package_installed)
	$(python) -m pytest --hypothesis-profile=fuzz --timeout=14400 \
		$(or $(FUZZ_ARGS),test/fuzz test/process/test_kernel_cache.py)

soak: $(package_installed)
	PYTHONPATH=test/support:$$PYTHONPATH $(python) -m bench.soak $(SOAK_ARGS)

benchmark: $(package_installed)
	$(python) -m bench all --output docs/benchmarks.md $(BENCHMARK_ARGS)

matrix: $(dependencies_installed) $(tox_installed)
	PATH=$(subst $(space),:,$(pyenv_pythons)):$$PATH $(python) -m tox $(MATRIX_ARGS)

docs: $(package_installed) $(sphinx_installed)
	$(python) -m sphinx --fail-on-warning --keep-going --quiet -c docs . docs/_build
	@echo 'made docs/_build/docs/index.html'

lint: $(linted)
	$(python) -m ruff check .

# flake8 and pep257 take half a minute, and read only files that have changed since the last time.
$(linted): to_read = $(if $(filter-out $(sources),$?),.,$?)
$(linted): $(package_installed) setup.cfg $(sources)
	$(python) -m flake8 $(to_read)
	$(python) -m pydocstyle $(to_read)
	touch $@

clean:
	rm -rf $(venv) .tox build dist docs/_build install log *.egg-info .hypothesis .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(dependencies_installed): $(requirements)
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit( \
		"Python 3.11 or newer is needed, $(PYTHON) is older: choose one with PYTHON=...")'
	$(PYTHON) -m venv --clear $(venv_options) $(venv)
	$(pip_install) $(addprefix --requirement ,$(requirements))
	touch $@

$(package_installed): $(dependencies_installed) package.xml setup.py pyproject.toml \
		$(wildcard resource/* config/* launch/*)
	$(pip_install) --no-deps --editable .
	touch $@

$(sphinx_installed): requirements/docs.txt $(dependencies_installed)
	$(pip_install) --requirement requirements/docs.txt
	touch $@

$(tox_installed): requirements/matrix.txt $(dependencies_installed)
	$(pip_install) --requirement requirements/matrix.txt
	touch $@
