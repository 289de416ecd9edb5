#!/usr/bin/env bash
# Makes .venv/clients: roslibpy (PyPI) with its own dependencies and roslib (npm, without its own: the browser's build is
# whole). What cannot be installed is left out, and its test is skipped by name; delete .venv/clients to try again.
set -uo pipefail
cd "$(dirname "$0")/.."
clients=.venv/clients list=tools/client-packages.txt list_npm=tools/client-packages-npm.txt
cat "$list" "$list_npm" | cmp -s - "$clients/tried.txt" && exit 0
echo "== clients: $(cat "$list" "$list_npm" | grep -cv '^#') rosbridge clients from PyPI and npm"
rm -rf "$clients"
/usr/bin/python3 -m venv "$clients" && "$clients/bin/python3" -m pip install --quiet --disable-pip-version-check -r "$list" \
    || echo "roslibpy cannot be installed: its test will be skipped"
if command -v npm >/dev/null; then
    (cd "$clients" && npm pack --silent "$(cat "../../$list_npm")" | xargs tar -xz --one-top-level=roslib --strip-components=1 -f) \
        || echo "roslib cannot be installed: its test will be skipped"
else
    echo "npm is not there: the test of roslib will be skipped"
fi
rm -f "$clients"/*.tgz
cat "$list" "$list_npm" >"$clients/tried.txt"
