"""shared_control: `cmd_vel_in` to `cmd_vel_out`; what a rider asks for by one of `sources`, with help where room is
short. What other sources command passes unchanged.
"""

import threading

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from std_msgs.msg import Bool, Float32, String

from canserial.ros.node import stop
from sara_common.config import ConfigError
from sara_common.diagnostics import OK, WARN
from sara_common.planar import yaw_from_quaternion, yaw_of
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import on_shutdown, start_node
from sara_control.assist.correction import Correction, sentence
from sara_control.assist.help_profiles import HelpProfiles
from sara_control.assist.local_grid import GridError, LocalGrid
from sara_control.assist.shared_control import SharedControl

OCCUPIED = 100  # of nav_msgs/OccupancyGrid, as costmap_2d publishes obstacles
FRESH = 0.5  # s: an older pose or velocity is not used
STATUS_PERIOD = 0.5  # s between two sentences
LEFT_PERIOD = 1.0  # s between two of what is left of an override


class SharedControlNode:
    """The shell around SharedControl."""

    def __init__(self) -> None:
        params = dict(rospy.get_param('~', {}))
        self.base_frame = params.pop('robot_base_frame', 'base_link')
        try:
            profiles = HelpProfiles.from_params(params)
        except ConfigError as error:
            stop(f'wrong configuration of {rospy.get_name()}: {error}')
        self.profiles, self.assist = profiles.configs, SharedControl(profiles.config)
        self.lock = threading.Lock()
        self.stopping = threading.Event()
        self.source, self.frame, self.dropped = '', None, {}
        self.driven, self.driven_at = (0.0, 0.0), -np.inf
        self.correction, self.said, self.said_at = None, None, -np.inf
        self.diagnostics = Diagnostics('shared control', 'rider')
        self.out = rospy.Publisher('cmd_vel_out', Twist, queue_size=1, tcp_nodelay=True)
        self.status = rospy.Publisher('~status', String, queue_size=10, latch=True, tcp_nodelay=True)
        self.in_use = rospy.Publisher('~profile_in_use', String, queue_size=10, latch=True, tcp_nodelay=True)
        self.in_use.publish(profiles.name)
        self.override_left = rospy.Publisher('~override_left', Float32, queue_size=10, latch=True, tcp_nodelay=True)
        self.left = -1.0
        self.tell(rospy.get_time())
        self.tf = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.tf)
        for topic, kind, handle in (
            ('cmd_vel_mux/active', String, self.on_source),
            ('costmap', OccupancyGrid, self.on_grid),
            ('odom', Odometry, self.on_odometry),
            ('~override', Bool, self.on_override),
            ('~profile', String, self.on_profile),
            ('cmd_vel_in', Twist, self.on_command),
        ):
            rospy.Subscriber(topic, kind, handle, queue_size=1, tcp_nodelay=True)
        on_shutdown(self.on_shutdown)

    def on_source(self, message: String) -> None:
        """Who drives from now on."""
        with self.lock:
            self.source, self.correction = message.data, None
            self.assist.let_go()

    def on_override(self, message: Bool) -> None:
        """The rider's button: true, no help for a while; false, help again."""
        now = rospy.get_time()
        with self.lock:
            self.assist.override(now, message.data)
        self.tell(now, at_once=True)
        rospy.loginfo('the rider goes alone' if message.data else 'the rider is helped again')

    def on_profile(self, message: String) -> None:
        """Another rider, from the next command on."""
        name, now = message.data, rospy.get_time()
        if name not in self.profiles:
            rospy.logwarn('there is no profile %s; there are: %s', name, ', '.join(self.profiles))
            return
        with self.lock:
            self.assist.use(self.profiles[name])
            self.correction = None
            self.in_use.publish(name)
        self.tell(now, at_once=True)
        rospy.loginfo('the profile is %s', name)

    def on_odometry(self, message: Odometry) -> None:
        """How fast the robot is."""
        twist = message.twist.twist
        with self.lock:
            self.driven, self.driven_at = (twist.linear.x, twist.angular.z), rospy.get_time()

    def on_grid(self, message: OccupancyGrid) -> None:
        """A costmap, in a frame that does not move with the robot; a turned one is refused."""
        info = message.info
        try:
            if abs(yaw_of(info.origin.orientation)) > 1e-3:
                raise GridError('the costmap is turned')
            if len(message.data) != info.width * info.height:
                raise GridError(f'the costmap of {info.width} x {info.height} cells has {len(message.data)}')
            blocked = np.array(message.data, np.int8).reshape(info.height, info.width) == OCCUPIED
            grid = LocalGrid(blocked, info.resolution, info.origin.position.x, info.origin.position.y)
            with self.lock:
                self.assist.on_grid(grid, message.header.stamp.to_sec())
                self.frame = message.header.frame_id.lstrip('/')
        except GridError as error:
            self.drop(str(error))

    def drop(self, why: str) -> None:
        """Counts what could not be used, and says each reason once."""
        if why not in self.dropped:
            rospy.logwarn('dropped: %s', why)
        self.dropped[why] = self.dropped.get(why, 0) + 1

    def pose(self, now: float) -> tuple[float, float, float] | None:
        """(x, y, yaw) of the robot in the costmap's frame; None where that is not known, or old."""
        if self.frame is None:
            return None
        try:
            found = self.tf.lookup_transform(self.frame, self.base_frame, rospy.Time())
            if not abs(now - found.header.stamp.to_sec()) <= FRESH:
                return None
            t, q = found.transform.translation, found.transform.rotation
            return t.x, t.y, yaw_from_quaternion(q.x, q.y, q.z, q.w)
        except (tf2_ros.TransformException, ValueError):
            return None

    def on_command(self, message: Twist) -> None:
        """A command of who drives."""
        with self.lock:
            if self.stopping.is_set():
                return
            now = rospy.get_time()
            if self.source in self.assist.config.sources:
                driven = self.driven if 0.0 <= now - self.driven_at <= FRESH else (0.0, 0.0)
                result = self.assist.step(now, (message.linear.x, message.angular.z), self.pose(now), driven)
                self.correction = result.correction
                message = Twist()
                message.linear.x, message.angular.z = result.v, result.w
            else:
                self.correction = None
            self.out.publish(message)
        self.tell(now)

    def tell(self, now: float, at_once: bool = False) -> None:
        """Publishes the sentence for the rider, where it is another, and how long an override still lasts, s."""
        with self.lock:
            left = self.assist.override_left(now)
            text = sentence(self.doing(left))
            if text != self.said and (at_once or not 0.0 <= now - self.said_at < STATUS_PERIOD):
                self.said, self.said_at = text, now
                self.status.publish(text)
                rospy.logdebug(text)
            if left != self.left and (at_once or left == 0.0 or not 0.0 <= self.left - left < LEFT_PERIOD):
                self.left = left
                self.override_left.publish(left)

    def doing(self, left: float) -> Correction | None:
        """What is done otherwise than asked; left: s that an override still lasts."""
        if not self.assist.config.enabled:
            return Correction.OFF
        return Correction.OVERRIDE if left > 0.0 else self.correction

    def on_shutdown(self) -> None:
        """The last word is stop."""
        with self.lock:
            self.stopping.set()
            self.out.publish(Twist())
        rospy.rostime.wallsleep(0.1)

    def run(self) -> None:
        """What is to be told without a command, and diagnostics, once a second of wall time until ROS shuts down."""
        while not self.stopping.wait(1.0):
            now = rospy.get_time()
            self.tell(now)
            with self.lock:
                correction, dropped = self.doing(self.assist.override_left(now)), sum(self.dropped.values())
            values = {'source': self.source, 'dropped': dropped}
            blind = correction is Correction.UNKNOWN
            self.diagnostics.publish(WARN if blind or dropped else OK, sentence(correction), values)


def main() -> None:
    """Run the node."""
    start_node('shared_control')
    SharedControlNode().run()
    rospy.spin()
