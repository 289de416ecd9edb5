#!/usr/bin/env bash
# Configures and builds the workspace (devel space), or with `install` installs it too. One build at a time.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${1:-all}
exec 9>.venv/build.lock
flock 9
python=$PWD/.venv/bin/python3
# Only ours and Debian's: a sourced workspace of another project must not be frozen into this one.
unset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH PYTHONPATH
mkdir -p build devel/lib/python3/dist-packages
if [ "$target" = install ]; then mkdir -p install && touch install/CATKIN_IGNORE; fi  # this folder is the source space too
log=build/build.log
stamp=$(find CMakeLists.txt tools/python-packages.txt src -name CMakeLists.txt -o -name package.xml -o -name setup.py -o -name '*.msg' -o -name '*.srv' -o -name '*.action' -o -name '*.cfg' \
        -o -path '*/nodes/*' -o -path '*/scripts/*' -o -name '*.test' -o -path tools/python-packages.txt | sort | xargs stat -c '%n %Y' | sha1sum)
run() { "$@" >>"$log" 2>&1 || { tail -n 40 "$log" >&2; echo "build failed: $log has the whole of it" >&2; exit 1; }; }
# Kernels are compiled for the types that their modules' warm() calls them with; what is fresh is left alone.
kernels() {
    local space=$1 setup=$1/setup.bash
    (set +u; source "$setup"; "$python" -m ahead_of_time.build "$space/lib/python3/dist-packages" sara_common sara_control sara_lab sara_localization sara_nav sara_sim sara_slam 2>>"$log") \
        || { tail -n 40 "$log" >&2; echo "the kernels were not compiled: $log says why" >&2; exit 1; }
}
# Python writes down what it compiled where it may, but not under PYTHONDONTWRITEBYTECODE nor in a tree it may not write to: then each process would compile
# a hundred modules before it begins.
bytecode() { "$python" -m compileall -q src >>"$log" 2>&1 || true; }
if [ "$target" = all ] && [ -f build/built.stamp ] && [ "$stamp" = "$(cat build/built.stamp)" ]; then kernels devel; bytecode; exit 0; fi
echo "== build: catkin packages into devel/ (log: $log)"
: >"$log"
run cmake -S . -B build -DCMAKE_BUILD_TYPE=Release -DCATKIN_DEVEL_PREFIX="$PWD/devel" -DCMAKE_INSTALL_PREFIX="$PWD/install" \
    -DPYTHON_EXECUTABLE="$python" -DCATKIN_ENABLE_TESTING=ON
run cmake --build build --target "$target" -- -j"$(nproc)"
echo "$stamp" >build/built.stamp
[ "$target" = all ] && kernels devel && bytecode
# catkin leaves `env python3` in what it installs; on a machine with another python3 first on PATH that one has no ROS.
if [ "$target" = install ]; then
    grep -rlE '^#!/usr/bin/env python3' install/lib/*/ | xargs -r sed -i "1s|^#!/usr/bin/env python3.*|#!$python|"
    kernels install
fi
