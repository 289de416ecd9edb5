#!/usr/bin/env bash
# Tries the packages of `make deb` on a bare Debian 12 (debootstrap in a chroot below build/). Needs root, debootstrap and a
# mirror; not part of `make test`.
#
#     tools/deb_check.sh BAG PARAMETERS        a bag, and a file of ekf_localization_node's parameters for it
#
# All packages: they install, the simulated chair drives to a goal without a network, they go without a trace.
# sara-localization and what it needs: an ordinary user filters the bag, to the digit as in devel/.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -eq 2 ] || { sed -n '5p' "$0" >&2; exit 2; }
[ "$(id -u)" -eq 0 ] || { echo "root is needed: chroot" >&2; exit 2; }
# In namespaces of its own: nothing that is mounted or started here outlives it.
[ -n "${SARA_DEB_CHECK:-}" ] || SARA_DEB_CHECK=1 exec unshare --mount --pid --fork --kill-child --mount-proc "$0" "$@"
bag=$1 parameters=$2 work=$PWD/build/deb_check debs=$PWD/out/deb
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | head -n 1)
log=$work/deb_check.log
ls "$debs"/sara-python_*.deb >/dev/null
mkdir -p "$work/archives/partial"
: >"$log"

failed() { tail -n 40 "$log" >&2; echo "FAILED: $1 ($log)" >&2; exit 1; }
within() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp/home LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive bash -ec "$1"; }
aptly() { within "apt-get -q -y -o Dpkg::Use-Pty=0 --no-install-recommends $*" >>"$log" 2>&1 || failed "apt-get $*"; }
files() { within 'find / -xdev \( -path /proc -o -path /dev -o -path /sys -o -path /tmp -o -path /debs -o -path /var/cache -o -path /var/log -o -path /var/lib/apt \) -prune -o -print | sort'; }
bare() {
    root=$work/$1
    [ -d "$work/bare" ] || { debootstrap --variant=minbase bookworm "$work/bare.new" "$mirror" >>"$log" 2>&1 || failed debootstrap; mv "$work/bare.new" "$work/bare"; }
    rm -rf --one-file-system "$root"
    cp -a "$work/bare" "$root"
    cp /etc/resolv.conf /etc/hosts "$root/etc/"
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    mount --bind "$work/archives" "$root/var/cache/apt/archives"
    mkdir "$root/debs" "$root/tmp/home"
    cp "$debs"/*.deb "$root/debs/"
    chmod 1777 "$root/tmp" "$root/tmp/home"
    aptly update
}
gone() {
    aptly purge "'sara-*'"
    files >"$work/after.txt"
    diff "$work/before.txt" "$work/after.txt" >>"$log" || failed 'apt purge left something, or took too much'
    within '[ ! -e /opt/sara ] && ! dpkg-query -W "sara-*" 2>/dev/null | grep .' || failed 'apt purge left something'
    echo "purged: no file is left of $1"
}

echo "== deb_check: all packages on a bare Debian 12 (log: $log)"
bare robot
theirs=$(within 'apt-get -s --no-install-recommends install /debs/*.deb' | sed -n 's/^Inst \([^ ]*\) .*/\1/p' | grep -v '^sara-')
aptly install $theirs
files >"$work/before.txt"
aptly install '/debs/*.deb'
echo "installed: $(wc -w <<<"$theirs") packages of Debian, $(ls "$debs" | wc -l) of SARA, $(du -sm "$root/opt/sara" | cut -f 1) MB in /opt/sara, compiler: $(within 'command -v gcc || echo none')"
cat >"$root/tmp/drive" <<'END'
source /opt/sara/setup.bash
roslaunch sara_bringup sara.launch >/tmp/launch.log 2>&1 &
rosrun sara_bringup go 3.0 1.0 0 --timeout 180 --wait 120
status=$?
kill -INT %1 && wait
exit $status
END
unshare --net bash -c 'ip link set lo up && exec chroot "$@"' . "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp/home LC_ALL=C.UTF-8 bash /tmp/drive >>"$log" 2>&1 \
    || { cat "$root/tmp/launch.log" >>"$log"; failed 'the chair did not reach its goal'; }
echo "drove: $(grep -a . "$log" | tail -n 1)"
caches=$(find "$root/opt/sara" "$root/tmp/home" -name '*.nbi' | wc -l)
[ "$caches" = 0 ] || failed "numba compiled $caches functions that the packages should hold"
gone 'all packages'

echo "== deb_check: sara-localization alone"
bare alone
alone='/debs/sara-{localization,common,ahead-of-time,python}_*.deb'
theirs=$(within "apt-get -s --no-install-recommends install $alone" | sed -n 's/^Inst \([^ ]*\) .*/\1/p' | grep -v '^sara-')
aptly install $theirs
within 'useradd --home-dir /tmp/home rider'
files >"$work/before.txt"
aptly install "$alone"
cp "$bag" "$root/tmp/in.bag"
cp "$parameters" "$root/tmp/in.yaml"
within 'su rider -c "bash -ec \"source /opt/sara/setup.bash; rosrun sara_localization filter_bag /tmp/in.bag /tmp/home/out.bag --params /tmp/in.yaml --csv /tmp/home/out.csv\""' >>"$log" 2>&1 || failed 'filter_bag'
(set +u; source devel/setup.bash; rosrun sara_localization filter_bag "$bag" - --params "$parameters" --csv "$work/devel.csv") >>"$log" 2>&1 || failed 'filter_bag in devel/'
cmp "$work/devel.csv" "$root/tmp/home/out.csv" || failed 'the packages filter otherwise than devel/'
echo "filtered: $(wc -l <"$work/devel.csv") lines, to the digit as in devel/; ends $(tail -n 1 "$work/devel.csv" | cut -c 1-80)"
gone sara-localization
