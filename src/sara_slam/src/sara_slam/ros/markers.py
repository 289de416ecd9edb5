"""Frontiers as visualization_msgs/MarkerArray."""

from __future__ import annotations

import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from sara_slam.exploring.explorer import Explorer

BLUE, RED, GREEN = ColorRGBA(0.0, 0.0, 1.0, 1.0), ColorRGBA(1.0, 0.0, 0.0, 1.0), ColorRGBA(0.0, 1.0, 0.0, 1.0)
CELL, SPHERE = 0.05, 0.3  # m


def frontier_markers(explorer: Explorer, frame: str, stamp: rospy.Time) -> MarkerArray:
    """The frontiers of an Explorer in a frame: blue, red where they are given up; a green sphere where the robot looks
    from next. The first marker deletes those of before.
    """
    markers = [_marker(frame, stamp, 0, Marker.DELETEALL)]
    for number, frontier in enumerate(explorer.found, 1):
        marker = _marker(frame, stamp, number, Marker.ADD)
        marker.type, marker.color = Marker.POINTS, RED if explorer.given_up(frontier) else BLUE
        marker.scale.x = marker.scale.y = marker.scale.z = CELL
        marker.points = [Point(x, y, 0.0) for x, y in frontier.points.tolist()]
        markers.append(marker)
    if explorer.visit is not None:
        marker = _marker(frame, stamp, len(markers), Marker.ADD)
        marker.type, marker.color = Marker.SPHERE, GREEN
        marker.scale.x = marker.scale.y = marker.scale.z = SPHERE
        marker.pose.position.x, marker.pose.position.y = explorer.visit.pose.x, explorer.visit.pose.y
        markers.append(marker)
    return MarkerArray(markers)


def _marker(frame, stamp, number, action):
    marker = Marker(ns='frontiers', id=number, action=action)
    marker.header.frame_id, marker.header.stamp = frame, stamp
    marker.pose.orientation.w = 1.0
    return marker
