#!/usr/bin/env bash
# Makes the Python environment: Debian's interpreter and packages, plus the pinned list of tools/python-packages.txt and,
# without their dependencies, those of tools/python-packages-alone.txt.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$1 venv=$2 list=tools/python-packages.txt alone=tools/python-packages-alone.txt
cat "$list" "$alone" | cmp -s - "$venv/installed.txt" && exit 0
echo "== venv: $venv with $(cat "$list" "$alone" | grep -cv '^#') pinned packages from PyPI"
[ -x "$venv/bin/python3" ] || "$python" -m venv --system-site-packages "$venv"
touch "$venv/CATKIN_IGNORE"
"$venv/bin/python3" -m pip install --quiet --disable-pip-version-check -r "$list"
"$venv/bin/python3" -m pip install --quiet --disable-pip-version-check --no-deps -r "$alone"
cat "$list" "$alone" >"$venv/installed.txt"
