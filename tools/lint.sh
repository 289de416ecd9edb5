#!/usr/bin/env bash
# Checks manifests and CMake files (catkin_lint), formats and lints Python (ruff), and the rules of the house a machine can check.
set -uo pipefail
cd "$(dirname "$0")/.."
status=0
echo "== lint: catkin_lint"
ROS_PACKAGE_PATH=$PWD/src:/usr/share ROS_DISTRO=noetic PYTHONPATH= /usr/bin/catkin_lint --offline -q --strict src || status=1
echo "== lint: Python"
.venv/bin/python3 -m compileall -q src tools >/dev/null || status=1
.venv/bin/ruff format --check -q . || { echo "not formatted: make format"; status=1; }
.venv/bin/ruff check -q . || status=1
impure=$(grep -rlE '^[[:space:]]*(import|from)[[:space:]]+(rospy|rosbag|tf2_ros|tf|actionlib|robot_localization|[a-z_]+_msgs|dynamic_reconfigure)\b' src/*/src --include='*.py' | grep -v '/ros/')
[ -n "$impure" ] && { echo "ROS is imported outside src/PKG/ros/: $impure"; status=1; }
exit $status
