"""Bags published again: profiles, pace, clock, loops, and the same results as offline."""
import itertools
from pathlib import Path
import re

from bag_kinds import LATCHED, profile, types_with
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header, String

from depth_person.camera.bag import BagReader
from depth_person.cli import main
from depth_person.nodes.bag_player import offered_profile
from depth_person.nodes.cloud_messages import decode_cloud
from depth_person.nodes.image_messages import stamp_ns
from depth_person.replay.bags import BagWriter
from depth_person.replay.clouds import cloud_points

WALK = Path(__file__).parents[2] / 'demo/walk'
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
START = 1000 * 10**9
STEP = 20_000_000
RANGE = np.dtype([('range', '<f4'), ('track_id', '<i4')])


@pytest.fixture
def bag(tmp_path):
    """Return a bag with fifty stamped headers, a latched text and a type of its own."""
    types = types_with('my_msgs/msg/Wind', 'float64 value')
    make = types.types
    with BagWriter(tmp_path / 'bag', types=types) as writer:
        writer.add_topic('/map', 'std_msgs/msg/String', qos=[LATCHED])
        writer.add_topic('/head', 'std_msgs/msg/Header', qos=[profile(depth=1000)])
        writer.write('/map', START, make['std_msgs/msg/String'](data='the map'))
        writer.write('/wind', START, make['my_msgs/msg/Wind'](value=1.0))
        for index in range(50):
            time_ns = START + index * STEP
            stamp = make['builtin_interfaces/msg/Time'](
                sec=time_ns // 10**9, nanosec=time_ns % 10**9)
            writer.write('/head', time_ns, make['std_msgs/msg/Header'](
                stamp=stamp, frame_id=str(index)))
    return tmp_path / 'bag'


@pytest.mark.parametrize(('recorded', 'reliability', 'durability', 'depth'), [
    ([], 'RELIABLE', 'VOLATILE', 5),
    ([profile(reliability='BEST_EFFORT')], 'BEST_EFFORT', 'VOLATILE', 5),
    ([LATCHED], 'RELIABLE', 'TRANSIENT_LOCAL', 1),
    ([profile(depth=0)], 'RELIABLE', 'VOLATILE', 10),
    ([profile(reliability='BEST_EFFORT'), profile()], 'RELIABLE', 'VOLATILE', 5),
])
def test_the_recorded_profile_is_offered_again(recorded, reliability, durability, depth):
    offered = offered_profile(recorded)

    assert (offered.reliability, offered.durability, offered.depth) == (
        ReliabilityPolicy[reliability], DurabilityPolicy[durability], depth)


def test_messages_come_whole_in_order_and_in_their_time_with_a_clock(domain, bag):
    heads, published_ns = [], []

    def take(message, info):
        heads.append(message)
        published_ns.append(info['source_timestamp'])

    domain.node.create_subscription(Header, '/head', take, RELIABLE)
    clocks = domain.listen(Clock, '/clock', RELIABLE)
    player = domain.start('depth_person', 'play', bag, '--clock', '100', '--wait', '--rate', '0.5',
                          ready='playing')

    domain.spin_until(lambda: len(heads) == 50)
    maps = domain.listen(String, '/map', QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    domain.spin_until(lambda: maps and clocks[-1].clock.nanosec == 49 * STEP)

    assert maps[0].data == 'the map', 'a latched topic reaches who comes late'
    assert [message.frame_id for message in heads] == [str(index) for index in range(50)]
    late_ns = np.array(published_ns) - 2 * STEP * np.arange(50)
    assert np.median(late_ns - late_ns.min()) < 50_000_000
    ticks = [clock.clock.sec * 10**9 + clock.clock.nanosec for clock in clocks]
    assert ticks == sorted(ticks)
    assert ticks[-1] == START + 49 * STEP
    assert len(set(ticks)) > 100, 'more than one a message'
    assert player.exit_code() == 3
    assert '/wind: the type my_msgs/msg/Wind is not installed' in player.said
    assert '51 messages on 2 topics; published late by' in player.said


def test_a_loop_starts_over_until_ctrl_c_and_only_asked_topics_are_played(domain, bag):
    heads, maps = domain.listen(Header, '/head', RELIABLE), domain.listen(String, '/map')
    player = domain.start('depth_person', 'play', bag, '--loop', '--rate', '10', '--topics',
                          '/head', '--wait', ready='playing')

    domain.spin_until(lambda: len(heads) > 120)
    player.interrupt()

    assert player.exit_code() == 0, player.said
    assert 'Traceback' not in player.said
    numbers = [int(message.frame_id) for message in heads[:120]]
    assert numbers == list(itertools.islice(itertools.cycle(range(50)), 120))
    assert maps == []


def test_a_loop_over_next_to_no_time_does_not_flood(domain, tmp_path):
    make = types_with('my_msgs/msg/Wind', 'float64 value').types
    with BagWriter(tmp_path / 'bag') as writer:
        writer.write('/note', START, make['std_msgs/msg/String'](data='first'))
        writer.write('/note', START + 200_000, make['std_msgs/msg/String'](data='last'))
    published_ns = []
    domain.node.create_subscription(
        String, '/note', lambda _, info: published_ns.append(info['source_timestamp']), RELIABLE)
    player = domain.start(
        'depth_person', 'play', tmp_path / 'bag', '--loop', '--wait', ready='playing')

    domain.spin_until(lambda: len(published_ns) >= 10)
    player.interrupt()

    assert player.exit_code() == 0, player.said
    rounds_s = np.diff(published_ns[:10:2]) / 1e9
    assert np.median(rounds_s) == pytest.approx(0.1, abs=0.03)
    assert float(re.search(r'([\d.]+) ms \(median', player.said)[1]) < 50, 'each round anew'


@pytest.mark.parametrize(('arguments', 'fault'), [
    (['--topics', '/none'], 'has no /none; it has /map'),
    (['--rate', '0'], 'a rate of 0 is not from'),
    (['--topics', 'wind'], 'nothing in .* can be published: /wind: the type my_msgs/msg/Wind'),
])
def test_what_cannot_be_played_is_told(bag, capsys, arguments, fault):
    assert main(['play', str(bag), *arguments]) == 1

    assert re.search(fault, capsys.readouterr().err)


def test_a_name_that_is_none_of_ros_is_told(tmp_path, capsys):
    text = types_with('my_msgs/msg/Wind', 'float64 value').types['std_msgs/msg/String']
    with BagWriter(tmp_path / 'bag') as writer:
        writer.write('/front camera', START, text(data='of another recorder'))
        writer.write('/note', START, text(data='of ROS'))

    assert main(['play', str(tmp_path / 'bag')]) == 1
    assert re.search(
        "must not contain .*'/front camera'; choose others by --topics", capsys.readouterr().err)
    assert main(['play', str(tmp_path / 'bag'), '--topics', 'note']) == 0


LIVE = """
/**:
  ros__parameters:
    compressed: true
    use_sim_time: true
    max_age: 0.0
    qos_overrides./image_raw/compressed.subscription.reliability: reliable
    qos_overrides./person_keypoints.subscription: {reliability: reliable, depth: 10}
"""


def write_frames(path, stamps):
    """Write a bag with the demo's images of these stamps."""
    with BagReader(WALK) as source, BagWriter(path) as writer:
        for topic, time_ns, message in source.messages(['/camera_info', '/image_raw/compressed']):
            if stamp_ns(message.header) in stamps:
                writer.write(topic, time_ns, message)


def test_nodes_on_simulated_time_find_what_the_offline_run_finds(domain, tmp_path):
    params = tmp_path / 'params.yaml'
    params.write_text(LIVE)
    for node in ('pose_node', 'depth_node'):
        domain.start(node, '--ros-args', '--params-file', params)
    clouds = domain.listen(PointCloud2, '/person_depth/people', RELIABLE)
    player = domain.start('depth_person', 'play', WALK, '--clock', '--wait', '--rate', '0.3',
                          '--topics', '/image_raw/compressed', '/camera_info', ready='playing')
    domain.spin_until(lambda: len(clouds) >= 10)
    player.interrupt()
    player.exit_code()
    live = {stamp_ns(cloud.header): decode_cloud(cloud, RANGE)[0] for cloud in clouds}

    # A slow machine drops frames; the offline run is given those that were looked at.
    write_frames(tmp_path / 'seen', live.keys())
    assert main(['process', str(tmp_path / 'seen'), '-o', str(tmp_path / 'out'), '--quiet']) == 0

    with BagReader(tmp_path / 'out') as reader:
        offline = {stamp_ns(message.header): cloud_points(message)[0] for _, _, message in
                   reader.messages(['/person_depth/people'])}
    assert live.keys() == offline.keys()
    assert all(map(len, live.values()))
    for stamp, found in live.items():
        assert found['track_id'].tolist() == offline[stamp]['track_id'].tolist()
        np.testing.assert_allclose(found['range'], offline[stamp]['range'], rtol=1e-4)
