"""The node map_server: publishes a map read from a file, with what is drawn over it, latched; answers for it by
service, and changes it by service.
"""

import sys

import rospkg
import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse, LoadMap, LoadMapResponse

from sara_common.diagnostics import OK
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import start_node
from sara_nav.maps import edits
from sara_nav.maps.map_io import ImageError, MapDescription, MapError, MissingFile, load_description, load_image
from sara_nav.ros.conversions import grid_to_msg
from sara_nav.ros.map_edits import MapEdits

USAGE = (
    'usage: map_server MAP.yaml\n'
    '       map_server IMAGE RESOLUTION   (the old form: ~negate, ~occupied_thresh and ~free_thresh say the rest)\n'
    '       map_server                    (~yaml_filename says which)'
)


class MapServer:
    """Topics map, map_metadata, keepout_filter_mask and speed_filter_mask, services static_map, change_map and
    reload_edits.
    """

    def __init__(self):
        self.frame = rospy.get_param('~frame_id', 'map')
        self.message, self.source, self._plain = None, '', None
        self._metadata = rospy.Publisher('map_metadata', MapMetaData, queue_size=1, latch=True)
        self.publisher = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
        self._edits = MapEdits(self.frame, self._draw)

    def serve(self) -> None:
        """Offer the services; only when there is a map."""
        self._services = [
            rospy.Service('static_map', GetMap, lambda request: GetMapResponse(map=self.message)),
            rospy.Service('change_map', LoadMap, self._change),
        ]
        self._edits.serve()

    def load(self, description: MapDescription, source: str) -> None:
        """Read what a MapDescription describes, and the edits beside its YAML file `source`, and publish it; raises
        MapError, and then all stays as it was.
        """
        grid_map = load_image(description)
        of_image = source == description.image  # the old form
        self._edits.read(None if of_image else edits.beside(source))
        for key in description.unknown_keys:
            rospy.logwarn('%s: %s is no key of the map format and has no effect', source, key)
        self._plain, self.source = grid_map, source
        self._draw()
        rospy.loginfo('serving %s: %s', source, self.size)

    def _draw(self):
        """Publish the map with what is drawn over it."""
        now = rospy.Time.now()
        grid_map = self._edits.drawn(self._plain, now)
        self.message = grid_to_msg(grid_map.data, grid_map.geometry, grid_map.origin_yaw, self.frame, now)
        self._metadata.publish(self.message.info)
        self.publisher.publish(self.message)

    @property
    def size(self) -> str:
        """The size of the map in words."""
        info = self.message.info
        return f'{info.width} x {info.height} cells of {info.resolution:.3g} m'

    def _change(self, request):
        try:
            path = path_of(request.map_url)
            self.load(load_description(path), path)
        except MissingFile as error:
            return self._refuse(LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST, error)
        except ImageError as error:
            return self._refuse(LoadMapResponse.RESULT_INVALID_MAP_DATA, error)
        except MapError as error:
            return self._refuse(LoadMapResponse.RESULT_INVALID_MAP_METADATA, error)
        return LoadMapResponse(map=self.message, result=LoadMapResponse.RESULT_SUCCESS)

    @staticmethod
    def _refuse(result, error):
        rospy.logerr('change_map: %s; the map stays as it is', error)
        return LoadMapResponse(result=result)


def path_of(url: str) -> str:
    """Return the file that a map_url names: a path, file://PATH or package://PACKAGE/PATH; raises MissingFile."""
    if url.startswith('package://'):
        package, _, rest = url[len('package://') :].partition('/')
        try:
            return f'{rospkg.RosPack().get_path(package)}/{rest}'
        except rospkg.ResourceNotFound:
            raise MissingFile(f'{url}: there is no package {package}') from None
    return url[len('file://') :] if url.startswith('file://') else url


def described(arguments: list[str]) -> MapDescription:
    """Return the MapDescription that the command line asks for; raises MapError with a sentence."""
    if len(arguments) == 1:
        return load_description(arguments[0])
    rospy.logwarn('map_server IMAGE RESOLUTION is the old form; a YAML file says the same and the origin too')
    image, resolution = arguments
    values = {'negate': 0, 'occupied_thresh': 0.65, 'free_thresh': 0.196}
    for name, default in values.items():
        values[name] = rospy.get_param('~' + name, default)
        if isinstance(values[name], bool) and name != 'negate' or not isinstance(values[name], (int, float)):
            raise MapError(f'~{name} is {values[name]!r}, allowed is a number')
    try:
        return MapDescription(image=image, resolution=float(resolution), **{**values, 'negate': bool(values['negate'])})
    except ValueError:
        raise MapError(f'the resolution is {resolution!r}, allowed are numbers above 0 (m per cell)') from None


def wait_for_time() -> bool:
    """Wait until there is a time: the map's stamp would be zero. False when ROS shuts down meanwhile."""
    wall = rospy.rostime.wallsleep
    waited = 0.0
    while rospy.Time.now().is_zero() and not rospy.is_shutdown():
        if waited % 5.0 < 0.05:
            rospy.loginfo('waiting for /clock (use_sim_time is set)')
        wall(0.05)
        waited += 0.05
    return not rospy.is_shutdown()


def main() -> None:
    """Run the node until ROS shuts down; exit status 1 when there is no map to serve."""
    arguments = rospy.myargv(sys.argv)[1:]
    if len(arguments) > 2:
        sys.exit(USAGE)
    start_node('map_server', anonymous=True)
    if not arguments and rospy.get_param('~yaml_filename', ''):
        arguments = [str(rospy.get_param('~yaml_filename'))]
    if not arguments:
        sys.exit(USAGE)
    server = MapServer()
    try:
        description = described(arguments)
        if not wait_for_time():
            return
        server.load(description, arguments[0])
    except MapError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    server.serve()
    diagnostics = Diagnostics('map')
    while not rospy.is_shutdown():
        diagnostics.publish(
            OK,
            'serving a map of ' + server.size,
            {'file': server.source, 'frame_id': server.frame, 'subscribers': server.publisher.get_num_connections()},
        )
        try:
            rospy.sleep(1.0)
        except rospy.ROSTimeMovedBackwardsException:
            pass
        except rospy.ROSInterruptException:
            break
