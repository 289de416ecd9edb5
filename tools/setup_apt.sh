#!/usr/bin/env bash
# Installs the Debian packages of tools/apt-packages.txt that are missing. Asks for root only then.
set -euo pipefail
cd "$(dirname "$0")/.."
mapfile -t wanted < <(sed 's/#.*//; s/[[:space:]]*$//' tools/apt-packages.txt | grep -v '^$')
installed=$(dpkg-query -W -f='${db:Status-Abbrev} ${Package}\n' | sed -n 's/^ii  *//p')
mapfile -t missing < <(printf '%s\n' "${wanted[@]}" | sort -u | comm -23 - <(sort -u <<<"$installed"))
[ ${#missing[@]} -eq 0 ] && exit 0
echo "== apt: installing ${#missing[@]} Debian packages: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "These Debian packages are missing and there is no sudo; as root: apt-get install ${missing[*]}" >&2; exit 1; }
    as_root=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
