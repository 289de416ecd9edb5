"""Pytest plugin: makes ROS impossible to import, so that a pure module that needs it fails its tests."""

import importlib.abc
import sys

HIDDEN = {
    'rospy',
    'roslib',
    'rosbag',
    'rosgraph',
    'rostest',
    'roslaunch',
    'actionlib',
    'genpy',
    'tf',
    'tf2_py',
    'tf2_ros',
    'message_filters',
    'dynamic_reconfigure',
}


class RosFinder(importlib.abc.MetaPathFinder):
    """Refuses every ROS module by name: the list above, generated messages and services."""

    def find_spec(self, fullname, path=None, target=None):
        """Raise ImportError for ROS; None (not mine) for everything else."""
        parts = fullname.split('.')
        generated = len(parts) > 1 and parts[1] in ('msg', 'srv')
        if parts[0] in HIDDEN or parts[0].endswith(('_msgs', '_srvs')) or generated:
            raise ImportError(f'{fullname}: ROS is hidden from the tests of pure modules')
        return None


sys.meta_path.insert(0, RosFinder())
