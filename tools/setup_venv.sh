#!/usr/bin/env bash
# Makes the Python environment: Debian's interpreter and packages, plus the pinned lists of tools/python-packages.txt and
# tools/python-packages-lint.txt and, without their dependencies, those of tools/python-packages-alone.txt.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$1 venv=$2 list=tools/python-packages.txt lint=tools/python-packages-lint.txt alone=tools/python-packages-alone.txt
cat "$list" "$lint" "$alone" | cmp -s - "$venv/installed.txt" && exit 0
echo "== venv: $venv with the pinned packages from PyPI"
[ -x "$venv/bin/python3" ] || "$python" -m venv --system-site-packages "$venv"
touch "$venv/CATKIN_IGNORE"
"$venv/bin/python3" -m pip install --quiet --disable-pip-version-check -r "$list" -r "$lint"
"$venv/bin/python3" -m pip install --quiet --disable-pip-version-check --no-deps -r "$alone"
cat "$list" "$lint" "$alone" >"$venv/installed.txt"
