#!/usr/bin/env bash
# Makes a bare Debian 12 in a folder, or leaves the one that is there alone. Packages come from this machine's mirror.
# Needs root and debootstrap.
#
#     tools/bare_debian.sh FOLDER LOG [ARCHITECTURE ENTER ...]    ENTER ... FOLDER PROGRAM: starts a program of it in it
set -euo pipefail
root=$1 log=$2 options=(--variant=minbase)
[ ! -d "$root" ] || exit 0
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | head -n 1)
rm -rf --one-file-system "$root.new"
if [ $# -gt 2 ]; then options+=(--foreign --arch="$3"); fi  # unpacks; what its packages do at installation is done in it
debootstrap "${options[@]}" bookworm "$root.new" "$mirror" >>"$log" 2>&1
if [ $# -gt 2 ]; then "${@:4}" "$root.new" /debootstrap/debootstrap --second-stage >>"$log" 2>&1; fi
mv "$root.new" "$root"
