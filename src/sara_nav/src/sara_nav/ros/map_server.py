"""The node map_server: publishes a map read from a file, once, latched, and answers for it by service."""
import sys

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse

from sara_nav.map_io import MapError, load_map
from sara_nav.ros.common import OK, Diagnostics
from sara_nav.ros.conversions import grid_to_msg

USAGE = 'usage: map_server MAP.yaml'


def main():
    """Run the node until ROS shuts down; exit status 1 when there is no map to serve."""
    arguments = rospy.myargv(sys.argv)[1:]
    if len(arguments) != 1:
        sys.exit(USAGE)
    rospy.init_node('map_server')
    try:
        grid_map = load_map(arguments[0])
    except MapError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    g = grid_map.geometry
    frame = rospy.get_param('~frame_id', 'map')
    msg = grid_to_msg(grid_map.data, g, grid_map.origin_yaw, frame, rospy.Time.now())
    metadata = rospy.Publisher('map_metadata', MapMetaData, queue_size=1, latch=True)
    publisher = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
    rospy.Service('static_map', GetMap, lambda request: GetMapResponse(map=msg))
    metadata.publish(msg.info)
    publisher.publish(msg)
    size = '%d x %d cells of %.3g m' % (g.width, g.height, g.resolution)
    rospy.loginfo('serving %s: %s', arguments[0], size)
    diagnostics = Diagnostics('map')
    while not rospy.is_shutdown():
        diagnostics.publish(OK, 'serving a map of ' + size, {
            'file': arguments[0], 'frame_id': frame, 'subscribers': publisher.get_num_connections()})
        try:
            rospy.sleep(1.0)
        except rospy.ROSTimeMovedBackwardsException:
            pass
        except rospy.ROSInterruptException:
            break
