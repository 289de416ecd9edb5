#!/usr/bin/env bash
# Mutation testing (tools/mutants.py), in an environment of its own below build/. Not part of `make test`.
set -eo pipefail
cd "$(dirname "$0")/.."
list=tools/mutation-packages.txt venv=build/mutation_venv
if ! cmp -s "$list" "$venv/installed.txt"; then
    echo "== venv: $venv with $(grep -cv '^#' "$list") packages for mutation testing"
    mkdir -p build
    /usr/bin/python3 -m venv --system-site-packages "$venv"
    touch "$venv/CATKIN_IGNORE"
    "$venv/bin/python3" -m pip install --quiet --disable-pip-version-check -r "$list"
    cp "$list" "$venv/installed.txt"
fi
source devel/setup.bash
export PYTHONPATH=$PYTHONPATH:$(echo "$PWD"/.venv/lib/python3*/site-packages) # what tools/python-packages.txt pins
exec "$venv/bin/python3" tools/mutants.py "$@"
