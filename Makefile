# The whole of SARA from a bare Debian 12: `make run` drives the simulated chair, `make test` runs every test.
# Each target sets up what is missing first. Root or sudo is needed only while a Debian package is missing.
SHELL := /bin/bash
.DELETE_ON_ERROR:
.PHONY: run test bench campaign skills experiments mutants lint house format clean help setup apt venv build install deb arm64

# Debian's interpreter, whichever python3 is first on PATH; ROS lives in its site-packages.
PYTHON := /usr/bin/python3
VENV   := .venv
ENV    := source devel/setup.bash &&

help: ## this list
	@echo "SARA: a ROS 1 navigation stack for plain Debian 12"
	@sed -n 's/^\([a-z0-9]*\):.*## /  make \1\t/p' Makefile | expand -t 18

run: build ## drive the simulated chair round the thesis's square; results in out/ (PLATFORM=kate: another robot)
	@echo "== run: the square on the simulated chair"
	@$(ENV) rosrun sara_bringup run_square --out out $(if $(PLATFORM),--platform $(PLATFORM))

test: build ## every test: units without ROS, then the rostests (PLATFORM=kate: of another robot)
	@$(if $(PLATFORM),SARA_PLATFORM=$(PLATFORM)) tools/run_tests.sh

bench: build ## how fast it is, against a yardstick timed in the same run; out/bench.json (CHECK=1: fails on what got slower)
	@$(ENV) rosrun sara_lab bench --out out $(if $(CHECK),--check)

campaign: build ## everything judged over many chairs, and a million random inputs; resumable; docs/campaign.json
	@$(ENV) rosrun sara_lab campaign --out out/campaign --json docs/campaign.json
	@$(ENV) rosrun sara_lab fuzz_bus --count 1000000 --seed 0
	@$(ENV) rosrun sara_lab fuzz_hmi --count 1000000 --seed 0
	@$(ENV) rosrun sara_lab fuzz_navigation --count 100000 --seed 0
	@$(ENV) rosrun sara_lab fuzz_amcl --count 1000000 --seed 0
	@$(ENV) rosrun sara_lab fuzz_ranges --count 1000000 --seed 0
	@$(ENV) rosrun sara_lab fuzz_navsat --count 1000000 --seed 0
	@$(ENV) rosrun sara_lab fuzz_slam --count 1000000 --seed 0
	@tools/run_tests.sh random

skills: build ## a clinic's test of wheelchair skills, by goals, by a trembling hand with help, and by hand; docs/skills.md (SEEDS=50)
	@$(ENV) rosrun sara_lab campaign skills --out out/campaign --seeds $(or $(SEEDS),2)

experiments: build ## the thesis's E1 to E10, ten minutes; pages in out/experiments (SEEDS=50: those of docs/experiments, an hour; resumable)
	@$(ENV) rosrun sara_lab experiment all $(if $(SEEDS),--seeds $(SEEDS) --keep out/experiments_kept,--out out/experiments)

mutants: build ## mutation testing of the safety gate, and of who may move the chair by joystick and touch screen and when
	@tools/mutants.sh

lint: venv ## manifests, CMake files and Python sources
	@tools/lint.sh

house: venv ## packages, rooms, lines and imports as text, and as a picture in out/; fails on a circle
	@$(VENV)/bin/python3 tools/house.py

format: venv ## format the Python sources
	@.venv/bin/ruff check -q --fix --select I .; .venv/bin/ruff format .

build: venv ## build the catkin workspace into devel/
	@tools/build.sh

install: build ## install the packages into install/
	@echo "== install: into install/"
	@tools/build.sh install

deb: venv ## Debian packages for robots without a compiler, into out/deb
	@$(VENV)/bin/python3 tools/deb.py

arm64: build ## set up, build and test on an emulated arm64 Debian 12: hours; resumable; docs/arm64.md
	@$(VENV)/bin/python3 tools/arm64.py

setup: venv ## only the Debian packages and the Python environment

apt:
	@tools/setup_apt.sh

venv: apt
	@tools/setup_venv.sh $(PYTHON) $(VENV)
	@tools/setup_clients.sh

clean: ## remove everything that was built (out/ stays)
	rm -rf build devel install logs .catkin_tools $(VENV)
