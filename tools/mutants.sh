#!/usr/bin/env bash
# Mutation testing of the safety gate (tools/mutants.py); installs what it needs first. Not part of `make test`.
set -eo pipefail
cd "$(dirname "$0")/.."
list=tools/mutation-packages.txt
if ! cmp -s "$list" .venv/mutation.txt; then
    echo "== venv: $(grep -cv '^#' "$list") packages for mutation testing"
    .venv/bin/python3 -m pip install --quiet --disable-pip-version-check -r "$list"
    cp "$list" .venv/mutation.txt
fi
source devel/setup.bash
exec .venv/bin/python3 tools/mutants.py "$@"
