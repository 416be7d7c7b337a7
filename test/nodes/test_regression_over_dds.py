"""The regression bags, played to nodes in processes of their own, give their golden values."""
import pytest
from regression_cases import CASES, GOLDEN
from sensor_msgs.msg import PointCloud2

from depth_person.nodes.image_messages import stamp_ns
from depth_person.replay.clouds import cloud_points
from depth_person.replay.compare import compare
from depth_person.replay.golden import read_golden
from depth_person.replay.results import gather, PersonRows

#: By case: the nodes that the bag is played to, each with parameters beside the case's; and what
#: of the bag is played.
REPLAYS = {
    'walker': ({'pose_node': ['compressed:=true',
                              'qos_overrides./image_raw/compressed.subscription.depth:=20'],
                'depth_node': ['qos_overrides./person_keypoints.subscription.depth:=20']},
               ['/image_raw/compressed', '/camera_info']),
    'drone': ({'depth_node': ['qos_overrides./person_keypoints.subscription.depth:=40']},
              ['/person_keypoints', '/camera_info']),
}


def replayed(domain, name):
    """Return the results that come of playing a case's bag."""
    nodes, topics = REPLAYS[name]
    clouds = domain.listen(PointCloud2, 'person_depth/people', qos=100)
    given = ['{}:={}'.format(*each) for each in CASES[name].parameters.items()]
    for node, own in nodes.items():
        words = own + (given if node == 'depth_node' else [])
        domain.start(node, '--ros-args', *(part for word in words for part in ('-p', word)))
    player = domain.start(
        'depth_person', 'play', CASES[name].path, '--wait', '--topics', *topics, ready='playing')
    domain.spin_until(lambda: player.poll() is not None, timeout_s=60)
    before = -1
    while len(clouds) > before:  # until nothing more comes
        before = len(clouds)
        domain.spin_for(1.0)
    return gather('replay', {
        stamp_ns(cloud.header): (0, PersonRows.of_points(cloud_points(cloud).ravel(), 0))
        for cloud in clouds})


@pytest.mark.parametrize('name', REPLAYS)
def test_played_over_dds_a_bag_gives_its_golden_values(domain, name):
    golden, tolerances = read_golden(GOLDEN / f'{name}.json')
    result = compare(golden, replayed(domain, name), tolerances)
    # The nodes skip frames for which the machine is too slow, but measure none otherwise.
    both = result.pairs.both
    assert both.sum() > len(golden.people) / 2
    assert result.lone_frames[1] == 0
    assert result.beyond[both].mean() <= max(tolerances.allow, 0.1), result.range_change
