"""The regression bags, replayed over DDS to nodes in processes of their own, stay golden."""
import pytest
from regression_cases import CASES, GOLDEN
from sensor_msgs.msg import CameraInfo, CompressedImage, PointCloud2

from depth_person.camera.bag import BagReader
from depth_person.nodes.image_messages import stamp_ns
from depth_person.replay.clouds import cloud_points
from depth_person.replay.compare import compare
from depth_person.replay.golden import read_golden
from depth_person.replay.results import gather, PersonRows

INFO, IMAGE, KEYPOINTS = '/camera_info', '/image_raw/compressed', '/person_keypoints'


@pytest.fixture
def nodes(domain):
    """Return a function that starts nodes for a case, and gives the list of what they publish."""
    def start(name, *given):
        own = [f'depth_node:{key}:={value}' for key, value in CASES[name].parameters.items()]
        words = [part for word in (*own, *given) for part in ('-p', word)]
        clouds = domain.listen(PointCloud2, 'person_depth/people', qos=100)
        domain.start('depth_node', '--ros-args', *words)
        if any(word.startswith('pose_node') for word in given):
            domain.start('pose_node', '--ros-args', *words)
        return clouds

    return start


def compared(name, clouds):
    """Return what moved from a case's golden values to published results."""
    golden, tolerances = read_golden(GOLDEN / f'{name}.json')
    results = gather('replay', {
        stamp_ns(cloud.header): (0, PersonRows.of_points(cloud_points(cloud).ravel(), 0))
        for cloud in clouds})
    return compare(golden, results, tolerances)


def test_image_by_image_a_bag_gives_its_golden_values(domain, nodes):
    clouds = nodes(
        'walker', 'pose_node:compressed:=true',
        f'pose_node:qos_overrides.{IMAGE}.subscription.reliability:=reliable',
        f'depth_node:qos_overrides.{KEYPOINTS}.subscription.reliability:=reliable')
    publishers = {INFO: domain.publisher(CameraInfo, INFO),
                  IMAGE: domain.publisher(CompressedImage, IMAGE)}
    domain.spin_until(lambda: domain.node.count_subscribers(KEYPOINTS) == 1)
    domain.spin_for(0.5)  # pose_node is to find it, too
    with BagReader(CASES['walker'].path) as bag:
        for topic, _, data in bag.raw_messages(list(publishers)):
            before = len(clouds)
            publishers[topic].publish(bytes(data))
            if topic == IMAGE:  # the next one when this is done, however busy the machine is
                domain.spin_until(lambda: len(clouds) > before)  # noqa: B023
    result = compared('walker', clouds)
    assert result.agree, (result.range_change, result.sigma_change)


def test_played_keypoints_give_their_golden_values(domain, nodes):
    clouds = nodes('drone', f'depth_node:qos_overrides.{KEYPOINTS}.subscription.depth:=40')
    player = domain.start(
        'depth_person', 'play', CASES['drone'].path, '--wait', '--topics', KEYPOINTS, INFO,
        ready='playing')
    domain.spin_until(lambda: player.poll() is not None)
    domain.spin_for(1.0)
    result = compared('drone', clouds)
    # A busy machine may drop some; the first may overtake the CameraInfo.
    both = result.pairs.both
    assert both.mean() > 0.5
    assert result.lone_frames[1] == 0
    assert result.beyond[both].mean() < 0.1, (result.range_change, result.sigma_change)
