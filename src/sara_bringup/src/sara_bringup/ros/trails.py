"""trails: the ways a drive leaves behind it, as paths for RViz: ~fused, ~wheels_alone and, in simulation, ~true, all in
the map.

RViz shows odometry through map -> odom, that is, corrected; what the wheels alone would have made of the drive is not
to be seen otherwise.
"""

import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry, Path

from sara_bringup.missions.trail import Trail, WheelsAlone
from sara_common.planar import yaw_of
from sara_common.ros.node import start_node

PERIOD_S = 0.5


def _pose(message):
    pose = message.pose.pose
    return pose.position.x, pose.position.y, yaw_of(pose.orientation)


def main() -> None:
    """Run the node. ~start: [x, y, yaw] in the map where the drive begins; each /set_pose begins it anew. ~map_frame:
    map.
    """
    start_node('trails')
    frame = rospy.get_param('~map_frame', 'map')
    wheels = _wheels_alone()
    trails = {
        name: (Trail(), rospy.Publisher(f'~{name}', Path, queue_size=1, latch=True))
        for name in ('fused', 'wheels_alone', 'true')
    }

    def set_pose(message):
        wheels.restart(_pose(message))
        for trail, _ in trails.values():
            trail.clear()

    rospy.Subscriber(
        '/odometry/filtered', Odometry, lambda message: trails['fused'][0].add(_pose(message)), queue_size=1
    )
    rospy.Subscriber('/ground_truth', Odometry, lambda message: trails['true'][0].add(_pose(message)), queue_size=1)
    rospy.Subscriber(
        '/diff_drive_controller/odom',
        Odometry,
        lambda message: trails['wheels_alone'][0].add(wheels.pose(_pose(message))),
        queue_size=1,
    )
    rospy.Subscriber('/set_pose', PoseWithCovarianceStamped, set_pose, queue_size=1)

    def show(_event):
        for trail, publisher in trails.values():
            if trail.changed and publisher.get_num_connections():
                trail.changed = False
                publisher.publish(_path(list(trail.poses), frame))

    rospy.Timer(rospy.Duration(PERIOD_S), show, reset=True)
    rospy.spin()


def _wheels_alone():
    """The WheelsAlone from ~start on."""
    start = rospy.get_param('~start', [0.0, 0.0, 0.0])
    try:
        wheels = WheelsAlone(tuple(float(value) for value in start))
        if len(start) != 3:
            raise ValueError
    except (TypeError, ValueError):
        rospy.logfatal('~start is %r, allowed is [x, y, yaw], m and rad', start)
        raise SystemExit(1) from None
    return wheels


def _path(poses, frame):
    result = Path()
    result.header.frame_id, result.header.stamp = frame, rospy.Time.now()
    for x, y, _ in poses:
        entry = PoseStamped()
        entry.header = result.header
        entry.pose.position.x, entry.pose.position.y, entry.pose.orientation.w = x, y, 1.0
        result.poses.append(entry)
    return result
