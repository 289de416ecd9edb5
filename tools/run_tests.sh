#!/usr/bin/env bash
# Runs every test: the pure modules' units where ROS cannot be imported, then the rostests. Ends with the count.
# `run_tests.sh random`: the units alone, with new random examples in the property tests.
set -o pipefail
cd "$(dirname "$0")/.."
source devel/setup.bash || exit 1
results=$PWD/build/test_results
rm -rf "$results" && mkdir -p "$results/units"
status=0
[ "${1:-}" = random ] && export SARA_RANDOM_TESTS=1
echo "== test: units of the pure modules (ROS hidden from the interpreter)"
PYTHONPATH="$PWD/tools:$PYTHONPATH" .venv/bin/python3 -m pytest -p hide_ros -p steady --import-mode=importlib -q -p no:cacheprovider \
    --junit-xml="$results/units/units.xml" src/*/test/unit tools/test || status=1
[ "${1:-}" = random ] && exit $status
echo "== test: rostests (log: build/rostest.log)"
cmake --build build --target run_tests -- -j1 >build/rostest.log 2>&1 || status=1
.venv/bin/python3 tools/count_tests.py "$results" || status=1
exit $status
