"""A rospy node with a filter's traffic and no filter: what rospy alone costs, for bench_filter to stand a filter
beside.

It takes an Imu and an Odometry as rospy does and publishes Odometry and a transform at 50 Hz from a rospy.Timer.
"""

import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage

RATE = 50.0


def main() -> None:
    rospy.init_node('bare')
    newest = {}
    subscribers = [
        rospy.Subscriber('/imu/data', Imu, lambda msg: newest.update(imu=msg), tcp_nodelay=True),
        rospy.Subscriber(
            '/diff_drive_controller/odom', Odometry, lambda msg: newest.update(odometry=msg), tcp_nodelay=True
        ),
    ]
    odometry_pub = rospy.Publisher('bare/odometry', Odometry, queue_size=20, tcp_nodelay=True)
    transform_pub = rospy.Publisher('bare/tf', TFMessage, queue_size=20, tcp_nodelay=True)

    def publish(_event):
        odometry = newest.get('odometry')
        if odometry is None:
            return
        transform = TransformStamped(header=odometry.header, child_frame_id=odometry.child_frame_id)
        transform.transform.rotation = odometry.pose.pose.orientation
        odometry_pub.publish(odometry)
        transform_pub.publish(TFMessage([transform]))

    timer = rospy.Timer(rospy.Duration(1.0 / RATE), publish)
    rospy.spin()
    timer.shutdown()
    return subscribers


if __name__ == '__main__':
    main()
