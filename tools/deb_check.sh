#!/usr/bin/env bash
# Tries the packages of `make deb` on a bare Debian 12 (debootstrap in a chroot below build/). Needs root, debootstrap and a
# mirror; not part of `make test`.
#
#     tools/deb_check.sh BAG PARAMETERS [OPTION ...]    ekf_localization_node's parameters for the bag; filter_bag's options
#
# First sara-localization and what it needs: an ordinary user filters the bag, to the digit as in devel/. Then all packages:
# the simulated chair drives to a goal without a network. Each time apt purge must leave no file.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -ge 2 ] || { sed -n '5s/^# *//p' "$0" >&2; exit 2; }
[ "$(id -u)" -eq 0 ] || { echo "root is needed: chroot" >&2; exit 2; }
# In namespaces of its own: nothing that is mounted or started here outlives it.
[ -n "${SARA_DEB_CHECK:-}" ] || SARA_DEB_CHECK=1 exec unshare --mount --pid --fork --kill-child --mount-proc "$0" "$@"
trap "exit 130" INT TERM  # the first process of a namespace ignores them otherwise
bag=$1 parameters=$2 more=("${@:3}") work=$PWD/build/deb_check debs=$PWD/out/deb
root=$work/robot log=$work/deb_check.log
environment=(PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp/home LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive)
options='-q -y -o Dpkg::Use-Pty=0 -o Dpkg::Options::=--force-unsafe-io --no-install-recommends'
ls "$debs"/sara-python_*.deb >/dev/null

failed() { tail -n 40 "$log" >&2; echo "FAILED: $1 ($log)" >&2; exit 1; }
within() { chroot "$root" env -i "${environment[@]}" bash -ec "$1"; }
aptly() { within "apt-get $options $*" >>"$log" 2>&1 || failed "apt-get $*"; }
files() { within 'find / -xdev \( -path /proc -o -path /dev -o -path /sys -o -path /tmp -o -path /var/cache -o -path /var/log -o -path /var/lib/apt \) -prune -o -path /opt -o -print | sort'; }  # dpkg takes an empty /opt along
# Debian's packages first, as apt chooses them, then ours: what is there in between must be there after `apt purge`.
put() {
    local theirs
    theirs=$(within "apt-get -s $options install $1" | sed -n '/^Inst sara-/d; s/^Inst \([^ ]*\) .*/\1/p' | tr '\n' ' ')
    aptly install "$theirs"
    files >"$work/before.txt"
    aptly install "$1"
    echo "installed: $(wc -w <<<"$theirs") more packages of Debian, $(within 'ls /var/lib/dpkg/info/sara-*.list | wc -l') of SARA, $(du -sm "$root/opt/sara" | cut -f 1) MB in /opt/sara"
    # Debian's python3-tf2-ros brings a compiler along; ours must not need it.
    [ ! -d "$root/usr/lib/gcc" ] || find "$root/usr/lib/gcc" -name 'cc1*' -exec chmod a-x {} +
}
gone() {
    aptly purge "'sara-*'"
    files >"$work/after.txt"
    diff "$work/before.txt" "$work/after.txt" >>"$log" || failed 'apt purge left something, or took too much'
    echo "purged: the same $(wc -l <"$work/after.txt") files as before; /opt/sara: $(ls -d "$root/opt/sara" 2>/dev/null || echo gone)"
}

mkdir -p "$work/archives/partial"
: >"$log"
echo "== deb_check: a bare Debian 12 (log: $log)"
tools/bare_debian.sh "$work/bare" "$log" || failed debootstrap
rm -rf --one-file-system "$root"
cp -a "$work/bare" "$root"
cp /etc/resolv.conf /etc/hosts "$root/etc/"
mkdir -p "$root/tmp/debs" "$root/tmp/home"
cp "$debs"/*.deb "$root/tmp/debs/"
cp "$bag" "$root/tmp/in.bag"
cp "$parameters" "$root/tmp/in.yaml"
chmod 1777 "$root/tmp" "$root/tmp/home"
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --bind "$work/archives" "$root/var/cache/apt/archives"
aptly update
within 'useradd --home-dir /tmp/home rider'

echo "== deb_check: sara-localization alone"
put "$(cd "$root/tmp/debs" && printf '/tmp/debs/%s ' sara-{localization,robot-localization,geographic-msgs,common,description,ahead-of-time,python}_*.deb)"
cat >"$root/tmp/filter" <<'END'
source /opt/sara/setup.bash
rosrun sara_localization filter_bag /tmp/in.bag /tmp/home/out.bag --params /tmp/in.yaml --csv /tmp/home/out.csv "$@"
END
chroot --userspec=rider "$root" env -i "${environment[@]}" bash -e /tmp/filter "${more[@]}" >>"$log" 2>&1 || failed 'filter_bag'
(set +u; source devel/setup.bash; rosrun sara_localization filter_bag "$bag" - --params "$parameters" --csv "$work/devel.csv" "${more[@]}") >>"$log" 2>&1 || failed 'filter_bag in devel/'
cmp "$work/devel.csv" "$root/tmp/home/out.csv" || failed 'the packages filter otherwise than devel/'
echo "filtered: $(wc -l <"$work/devel.csv") lines, to the digit as in devel/; $(tail -n 1 "$log")"
gone

echo "== deb_check: all packages"
put "$(cd "$root/tmp/debs" && printf '/tmp/debs/%s ' *.deb)"
cat >"$root/tmp/drive" <<'END'
source /opt/sara/setup.bash
roslaunch sara_bringup sara.launch >/tmp/launch.log 2>&1 &
until (: </dev/tcp/127.0.0.1/11311) 2>/dev/null; do kill -0 $! || exit 1; sleep 1; done
rosrun sara_bringup go 3.0 1.0 0 --timeout 180 --wait 180
status=$?
kill $!
wait
exit $status
END
unshare --net bash -c 'ip link set lo up && exec chroot "$@"' chroot --userspec=rider "$root" env -i "${environment[@]}" bash /tmp/drive >"$work/drive.log" 2>&1 \
    || { cat "$root/tmp/launch.log" "$work/drive.log" >>"$log"; failed 'the chair did not reach its goal'; }
echo "drove: $(grep -a reached "$work/drive.log" | tail -n 1)"
caches=$(find "$root/opt/sara" "$root/tmp/home" -name '*.nbi' | wc -l)
echo "compiled meanwhile by numba: $caches functions"
gone
