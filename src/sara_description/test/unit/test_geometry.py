"""The URDF says what geometry.yaml says."""

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

HERE = Path(__file__).resolve().parents[2]
GEOMETRY = yaml.safe_load((HERE / 'config/geometry.yaml').read_text())
URDF = ElementTree.parse(HERE / 'urdf/sara.urdf').getroot()
JOINTS = {joint.find('child').get('link'): joint for joint in URDF.iter('joint')}


def placed(link):
    """(x, y, z), yaw of `link` in base_link."""
    origin = JOINTS[link].find('origin')
    return [float(v) for v in origin.get('xyz').split()], float(origin.get('rpy').split()[2])


@pytest.mark.parametrize(
    'link, place',
    [(name, GEOMETRY[name]) for name in ('imu_link', 'scan')]
    + [(f'{name}_frame', place) for name, place in GEOMETRY['ranges'].items()],
)
def test_sensor_is_where_the_table_says(link, place):
    xyz, yaw = placed(link)
    assert xyz == pytest.approx([place['x'], place['y'], place['z']])
    assert yaw == pytest.approx(math.radians(place['yaw_deg']), abs=1e-8)


def test_wheels_stand_on_the_floor_a_track_apart():
    (_, left_y, left_z), _ = placed('left_wheel')
    (_, right_y, right_z), _ = placed('right_wheel')
    assert left_y - right_y == pytest.approx(GEOMETRY['wheel']['track'])
    assert left_z == right_z == GEOMETRY['wheel']['radius']
    radii = [
        float(c.get('radius'))
        for w in ('left_wheel', 'right_wheel')
        for c in URDF.find(f"link[@name='{w}']").iter('cylinder')
    ]
    assert set(radii) == {GEOMETRY['wheel']['radius']}


def test_body_is_a_box_of_the_chairs_size():
    box = URDF.find("link[@name='base_link']/collision/geometry/box").get('size')
    assert [float(v) for v in box.split()] == [GEOMETRY['body'][side] for side in ('length', 'width', 'height')]


def test_every_frame_hangs_on_base_link():
    assert {joint.find('parent').get('link') for joint in JOINTS.values()} == {'base_link'}
