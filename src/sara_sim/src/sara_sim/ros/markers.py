"""Obstacles, ramps and thresholds as markers for RViz."""

from __future__ import annotations

from math import cos, sin

import rospy
from visualization_msgs.msg import Marker, MarkerArray

from sara_sim.world.world import World

HEIGHT = 1.2  # m, of what stands about
LIFETIME_S = 1.0


def markers(world: World, stamp: rospy.Time, lifetime: rospy.Duration) -> MarkerArray:
    """What the map does not show, where it is now. `lifetime`: rospy.Duration after which RViz forgets it."""
    array = MarkerArray()
    for number, (x, y, c, s, half, side) in enumerate(world.obstacles.shapes.tolist()):
        kind, width = (Marker.CYLINDER, 2.0 * half) if side < 0.0 else (Marker.CUBE, 2.0 * side)
        marker = _marker('obstacles', number, kind, stamp, lifetime, (0.85, 0.3, 0.1, 0.9))
        marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = x, y, HEIGHT / 2
        # Half the angle whose cosine and sine these are.
        marker.pose.orientation.w = max(0.5 * (1.0 + c), 0.0) ** 0.5
        marker.pose.orientation.z = max(0.5 * (1.0 - c), 0.0) ** 0.5 * (1.0 if s >= 0.0 else -1.0)
        marker.scale.x, marker.scale.y, marker.scale.z = 2.0 * half, width, HEIGHT
        array.markers.append(marker)
    for number, ramp in enumerate(world.ramps):
        marker = _marker('ramps', number, Marker.CUBE, stamp, lifetime, (0.2, 0.5, 0.8, 0.4))
        marker.pose.position.x, marker.pose.position.y = ramp.x, ramp.y
        # Yaw uphill, then the nose up by the slope: a negative pitch.
        cy, sy, cp, sp = cos(ramp.yaw / 2), sin(ramp.yaw / 2), cos(-ramp.slope / 2), sin(-ramp.slope / 2)
        marker.pose.orientation.x, marker.pose.orientation.y = -sp * sy, sp * cy
        marker.pose.orientation.z, marker.pose.orientation.w = cp * sy, cp * cy
        marker.scale.x, marker.scale.y, marker.scale.z = ramp.length, ramp.width, 0.02
        array.markers.append(marker)
    for number, strip in enumerate(world.thresholds):
        marker = _marker('thresholds', number, Marker.CUBE, stamp, lifetime, (0.2, 0.5, 0.8, 0.9))
        marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = strip.x, strip.y, strip.height / 2
        marker.pose.orientation.z, marker.pose.orientation.w = sin(strip.yaw / 2), cos(strip.yaw / 2)
        marker.scale.x, marker.scale.y, marker.scale.z = strip.length, strip.width, strip.height
        array.markers.append(marker)
    return array


def _marker(namespace: str, number: int, kind: int, stamp, lifetime, colour: tuple) -> Marker:
    marker = Marker()
    marker.header.stamp, marker.header.frame_id = stamp, 'map'
    marker.ns, marker.id, marker.type, marker.action, marker.lifetime = namespace, number, kind, Marker.ADD, lifetime
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = colour
    return marker
