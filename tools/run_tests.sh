#!/usr/bin/env bash
# Runs every test: the pure modules' units and the page's browser tests where ROS cannot be imported and, beside them, the
# rostests, which mostly wait.
# Then some of the units again on another robot, where a number of the first one that hides in code or in a test shows;
# SARA_PLATFORM=NAME: all tests on that robot alone.
# Ends with the count. `run_tests.sh random`: the units alone, with new random examples in the property tests.
set -o pipefail
cd "$(dirname "$0")/.."
source devel/setup.bash || exit 1
results=$PWD/build/test_results
rm -rf "$results" && mkdir -p "$results/units"
status=0
# One thread each for the linear algebra: the processes are as many as the cores. A file stays with one process, with what its tests share.
units() { # NAME PATH...: the JUnit file's name, what to run
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 PYTHONPATH="$PWD/tools:$PYTHONPATH" .venv/bin/python3 -m pytest -p hide_ros -p steady \
        --import-mode=importlib -q -p no:cacheprovider -n "$(nproc)" --dist loadfile --durations=15 \
        --junit-xml="$results/units/$1.xml" "${@:2}"
}
all=(src/*/test/unit src/*/test/browser tools/test)
elsewhere=(src/canserial/test/unit src/sara_common/test/unit src/sara_lowlevel/test/unit/test_*node.py
    src/sara_control/test/unit/test_{plausibility,guard}.py src/sara_sim/test/unit/test_{chair,config}.py)
if [ "${1:-}" = random ]; then
    echo "== test: units, with new random examples"
    SARA_RANDOM_TESTS=1 units units "${all[@]}"
    exit
fi
echo "== test: rostests (logs: build/test_results/PACKAGE/*.log), and the units beside them"
failed=0
{
    units units "${all[@]}" || failed=1
    if [ -z "${SARA_PLATFORM:-}" ]; then
        echo "== test: some units again, with the robot kate"
        SARA_PLATFORM=kate units kate "${elsewhere[@]}" || failed=1
    fi
    exit $failed
} >"$results/units/units.log" 2>&1 &
.venv/bin/python3 tools/rostests.py "$results" || status=1
wait $! || status=1
echo "== test: units of the pure modules (ROS hidden from the interpreter)"
cat "$results/units/units.log"
.venv/bin/python3 tools/count_tests.py "$results" || status=1
exit $status
