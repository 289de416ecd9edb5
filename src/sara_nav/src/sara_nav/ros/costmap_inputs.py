"""What the layers of a costmap listen to: maps, scans, clouds, ranges, footprints. Callbacks only queue; transforms and
layers are touched by whoever calls ``take_in``. A message that waits for its transform is tried again until it is too
old.
"""

import math
from collections import Counter, deque

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Polygon
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan, PointCloud, PointCloud2, Range

from sara_common.scans import shares_of, swept
from sara_nav.costmaps.layered_costmap import LayeredCostmap
from sara_nav.costmaps.layers.mask_filter import MaskFilter
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorLayer
from sara_nav.costmaps.layers.static import HERE, StaticLayer
from sara_nav.costmaps.observations import CloudLayout, Observation, cloud_points, scan_rays, transformed
from sara_nav.ros import conversions as conv
from sara_nav.ros.common import END_OF_TIME, TransformListener

MESSAGES = {'LaserScan': LaserScan, 'PointCloud': PointCloud, 'PointCloud2': PointCloud2}
LEVEL = 0.1
"""A range sensor whose axis has less than this of its length in the plane looks up or down, and is not used."""


class NotYet(Exception):
    """A transform may still come; the text says which is missing."""


class CostmapInputs:
    """Subscribes what the layers of a LayeredCostmap need. name: the costmap's ('local_costmap'); tf:
    TransformListener.

    ``counts``: messages dropped here, by kind; each kind is warned of once.
    """

    def __init__(self, name: str, costmap: LayeredCostmap, tf: TransformListener):
        self.counts = Counter()
        self._name, self._costmap, self._tf = name, costmap, tf
        self._waiting = deque(maxlen=1000)
        self._maps = deque(maxlen=100)
        self._map_frames = {}
        self._subscribers = []
        self._warned = set()
        self._listening = False
        self.start()

    def start(self) -> None:
        """Listen (again)."""
        if self._listening:
            return
        self._listening = True
        for layer in self._costmap.layers.values():
            if isinstance(layer, StaticLayer):
                self._listen_to_maps(layer)
            elif isinstance(layer, MaskFilter):
                self._subscribe(layer.config.mask_topic, numpy_msg(OccupancyGrid), self._on_map, layer, 1)
            elif isinstance(layer, ObstacleLayer):
                for source in layer.config.sources:
                    self._subscribe(
                        source.topic or source.name, MESSAGES[source.data_type], self._on_sensor, (layer, source), 50
                    )
            elif isinstance(layer, RangeSensorLayer):
                for topic in layer.config.sources():
                    self._subscribe(
                        topic if topic.startswith(('/', '~')) else f'~{self._name}/{layer.name}/{topic}',
                        Range,
                        self._on_sensor,
                        (layer, topic),
                        100,
                    )

    def stop(self) -> None:
        """Listen to nothing, as while the costmap is stopped; a map comes again after ``start``."""
        self._listening = False
        for subscriber in self._subscribers:
            subscriber.unregister()
        self._subscribers = []
        self._waiting.clear()

    def _subscribe(self, topic, kind, callback, args, queue):
        self._subscribers.append(rospy.Subscriber(topic, kind, callback, args, queue_size=queue, tcp_nodelay=True))

    def _listen_to_maps(self, layer):
        topic = layer.config.map_topic
        self._subscribe(topic, numpy_msg(OccupancyGrid), self._on_map, layer, 1)
        if layer.config.subscribe_to_updates:
            self._subscribe(topic + '_updates', numpy_msg(OccupancyGridUpdate), self._on_map_update, layer, 10)

    # -- callbacks: they only queue ----------------------------------------------------------------------------

    def _on_map(self, msg, layer):
        try:
            grid_map = conv.grid_from_msg(msg)
        except ValueError as error:
            self._drop('bad_maps', f'a map was dropped: {error}', every_time=True)
            return
        self._maps.append((layer, msg.header.frame_id.lstrip('/'), grid_map))

    def _on_map_update(self, msg, layer):
        if len(msg.data) != msg.width * msg.height:
            self._drop(
                'bad_map_updates',
                f'a map update was dropped: it says {msg.width} x {msg.height} cells but holds {len(msg.data)}',
            )
            return
        self._maps.append((layer, None, (msg.x, msg.y, np.array(msg.data, np.int8).reshape(msg.height, msg.width))))

    def _on_sensor(self, msg, target):
        if len(self._waiting) == self._waiting.maxlen:
            self._drop('overflow', f'more than {self._waiting.maxlen} messages wait to be taken in')
        self._waiting.append((msg,) + target)

    # -- taking in ---------------------------------------------------------------------------------------------

    def take_in(self, now: float) -> None:
        """Hand to the layers all that came and can be transformed by ``now`` (s)."""
        while self._maps:
            self._take_map(*self._maps.popleft())
        self._follow_map_frames()
        for _ in range(len(self._waiting)):
            msg, layer, source = self._waiting.popleft()
            try:
                if isinstance(layer, RangeSensorLayer):
                    layer.add_range(self._reading(msg, source, layer))
                else:
                    layer.add_observation(self._observation(msg, source, layer))
            except NotYet as missing:
                if abs(now - msg.header.stamp.to_sec()) <= max(layer.config.transform_tolerance, 0.1):
                    self._waiting.append((msg, layer, source))
                elif self._placed_whole(msg, source, layer):
                    self._drop('sweeps_placed_whole', f'layer {layer.name} places sweeps at their first ray: {missing}')
                else:
                    self._drop('no_transform', f'layer {layer.name} drops messages: {missing}')
            except ValueError as error:
                self._drop('bad_messages', f'layer {layer.name} drops messages: {error}')
        self._tell_drops()

    def _take_map(self, layer, frame, data):
        try:
            if frame is None:
                layer.update_map(*data)
                return
            if not frame or (frame != self._costmap.config.global_frame and not layer.rolling):
                raise ValueError(f'it is in frame {frame!r} but global_frame is {self._costmap.config.global_frame!r}')
            if isinstance(layer, MaskFilter):
                layer.set_mask(data)
            elif not layer.set_map(data):
                return
            self._map_frames[layer] = frame
            g = data.geometry
            rospy.loginfo(
                '%s/%s: map of %d x %d cells of %.3g m', self._name, layer.name, g.width, g.height, g.resolution
            )
        except ValueError as error:
            what = 'bad_map_updates' if frame is None else 'bad_maps'
            self._drop(
                what, 'a map{} was dropped: {}'.format(' update' if frame is None else '', error), frame is not None
            )

    def _follow_map_frames(self):
        for layer, frame in self._map_frames.items():
            if not layer.rolling:
                continue
            own = self._costmap.config.global_frame
            try:
                at = HERE if frame == own else conv.pose_from_transform(self._tf.latest(frame, own).transform)
                layer.set_frame(at)
            except (ValueError, tf2_ros.TransformException) as error:
                self._drop('no_map_transform', f'the map of layer {layer.name} stays where it was: {error}')

    def _transform(self, frame, stamp):
        """Return the geometry_msgs/Transform from a frame to the global one; raises NotYet or ValueError."""
        if not frame or stamp.secs >= END_OF_TIME:
            raise ValueError(f'an empty frame_id or a stamp too late: {frame!r}, {stamp.secs} s')
        try:
            return self._tf.buffer.lookup_transform(
                self._costmap.config.global_frame, frame.lstrip('/'), stamp
            ).transform
        except tf2_ros.TransformException as error:
            raise NotYet(str(error)) from None

    def _reading(self, msg, source, layer):
        t = self._transform(msg.header.frame_id, msg.header.stamp)
        q = t.rotation
        along, aside, _ = transformed([[1.0, 0.0, 0.0]], (0.0, 0.0, 0.0), (q.x, q.y, q.z, q.w))[0]
        level = math.hypot(along, aside)
        if level < LEVEL:
            raise ValueError(f'the range sensor {msg.header.frame_id} looks up or down')
        stamp = msg.header.stamp.to_sec()
        return RangeReading(
            source,
            stamp,
            t.translation.x,
            t.translation.y,
            math.atan2(aside, along),
            msg.range * level,
            msg.min_range * level,
            msg.max_range * level,
            msg.field_of_view,
        )

    def _placed_whole(self, msg, source, layer):
        """Place a sweep, whose last ray is later than any transform, where its first ray was; returns whether it could
        be done.
        """
        if not isinstance(msg, LaserScan) or not msg.time_increment > 0.0:
            return False
        msg.time_increment = 0.0
        try:
            layer.add_observation(self._observation(msg, source, layer))
        except (ValueError, NotYet):
            return False
        return True

    def _observation(self, msg, source, layer):
        if isinstance(msg, LaserScan):
            return self._scan(msg, source)
        if isinstance(msg, PointCloud2):
            fields = {field.name: (field.offset, field.datatype) for field in msg.fields if field.count <= 1}
            layout = CloudLayout(msg.width, msg.height, msg.point_step, msg.row_step, fields, msg.is_bigendian)
            points = cloud_points(msg.data, layout)
        else:
            points = np.array([[p.x, p.y, p.z] for p in msg.points], float).reshape(-1, 3)
        place = self._transform(msg.header.frame_id, msg.header.stamp)
        return self._seen(msg, source, place, transformed(points, *_numbers(place)))

    def _scan(self, msg, source):
        """The Observation of a LaserScan; each ray is placed at its own time where the message tells it."""
        angles, limits = (msg.angle_min, msg.angle_increment), (msg.range_min, msg.range_max)
        points, rays = scan_rays(msg.ranges, angles, limits, source.inf_is_valid)
        first = last = self._transform(msg.header.frame_id, msg.header.stamp)
        if msg.time_increment > 0.0 and len(msg.ranges) > 1:
            duration = conv.duration_of_sweep(msg.time_increment * (len(msg.ranges) - 1))
            last = self._transform(msg.header.frame_id, msg.header.stamp + duration)
        points = swept(points, shares_of(rays, len(msg.ranges)), _numbers(first), _numbers(last))
        return self._seen(msg, source, first, points)

    def _seen(self, msg, source, place, points):
        """What a source saw, its sensor at `place` or at its own frame."""
        origin = self._transform(source.sensor_frame, msg.header.stamp) if source.sensor_frame else place
        origin = origin.translation
        return Observation(source.name, msg.header.stamp.to_sec(), (origin.x, origin.y, origin.z), points)

    # -- what could not be used --------------------------------------------------------------------------------

    def time_went_back(self) -> None:
        """Forget what waits: its stamps mean nothing any more."""
        self._waiting.clear()

    def _drop(self, kind, text, every_time=False):
        self.counts[kind] += 1
        if every_time or kind not in self._warned:
            self._warned.add(kind)
            (rospy.logerr if every_time else rospy.logwarn)('%s: %s', self._name, text)

    def _tell_drops(self):
        for layer in self._costmap.layers.values():
            for kind in layer.counts:
                if (layer.name, kind) not in self._warned:
                    self._warned.add((layer.name, kind))
                    rospy.logwarn('%s: layer %s dropped %s', self._name, layer.name, layer.problem)

    def values(self) -> dict[str, int]:
        """Return what was dropped, for /diagnostics: {'costmap/layer/kind': how many}."""
        result = {f'{self._name}/{kind}': count for kind, count in self.counts.items()}
        for layer in self._costmap.layers.values():
            result.update((f'{self._name}/{layer.name}/{kind}', n) for kind, n in layer.counts.items())
        return result


def _numbers(transform):
    """(translation (3,), quaternion (4,)) of a geometry_msgs/Transform."""
    v, q = transform.translation, transform.rotation
    return (v.x, v.y, v.z), (q.x, q.y, q.z, q.w)


class FootprintInput:
    """Another footprint by topic. The peer's default has one name for the footprint it takes (Polygon) and the one it
    publishes (PolygonStamped), so any type is listened to and all but Polygon is passed over."""

    def __init__(self, topic: str):
        self._came = deque(maxlen=1)
        self._subscriber = rospy.Subscriber(topic, rospy.AnyMsg, self._on_any, queue_size=1, tcp_nodelay=True)

    def _on_any(self, msg):
        if msg._connection_header.get('type') == Polygon._type:  # pylint: disable=protected-access
            self._came.append(Polygon().deserialize(msg._buff))  # pylint: disable=protected-access

    def take(self) -> list | None:
        """Return the corners [[x, y], ...] of a footprint that came since, or None."""
        return [[p.x, p.y] for p in self._came.popleft().points] if self._came else None
