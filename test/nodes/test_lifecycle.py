"""The nodes' life as their manager sees it: services over DDS, and what is published meanwhile."""
from functools import partial
import time

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
import pytest
from sensor_msgs.msg import Image, PointCloud2

PARAMETERS = ('-p', 'input_size:=128')
OUTPUTS = {'camera_node': (Image, 'image_raw'), 'pose_node': (PointCloud2, 'person_keypoints'),
           'depth_node': (PointCloud2, 'person_depth/people')}


class Manager:
    """Changes states as `ros2 lifecycle set` does."""

    def __init__(self, domain):
        self._domain = domain

    def call(self, kind, name, request):
        client = self._domain.node.create_client(kind, name)
        self._domain.spin_until(client.service_is_ready)
        answer = client.call_async(request)
        self._domain.spin_until(answer.done)
        return answer.result()

    def change(self, node, transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        return self.call(ChangeState, f'{node}/change_state', request).success

    def state(self, node):
        return self.call(GetState, f'{node}/get_state', GetState.Request()).current_state.id


def _note_time(published_ns, _, info):
    published_ns.append(info['source_timestamp'])


@pytest.fixture(scope='module')
def composed(shared_domain, folder):
    """
    Return a domain with all nodes in one process, started by themselves.

    Its outputs are the times at which each published.
    """
    shared_domain.outputs = {node: [] for node in OUTPUTS}
    for node, (kind, topic) in OUTPUTS.items():
        note = partial(_note_time, shared_domain.outputs[node])
        shared_domain.node.create_subscription(kind, topic, note, 1)
    shared_domain.program = shared_domain.start(
        'depth_person', 'run', '--source', folder, '--loop', '--fps', '10',
        '--horizontal-fov', '60', '--ros-args', *PARAMETERS)
    shared_domain.spin_until(lambda: all(shared_domain.outputs.values()))
    return shared_domain


@pytest.mark.parametrize(('node', 'silent'), [
    ('camera_node', ('camera_node', 'pose_node', 'depth_node')),
    ('pose_node', ('pose_node', 'depth_node')),
    ('depth_node', ('depth_node',)),
])
def test_deactivating_a_node_stops_its_output_and_what_follows_until_it_is_activated(
        composed, node, silent):
    manager = Manager(composed)
    assert manager.state(node) == State.PRIMARY_STATE_ACTIVE
    assert manager.change(node, Transition.TRANSITION_DEACTIVATE)
    stopped_ns = time.time_ns()
    composed.spin_for(1.0)
    assert max(composed.outputs[node], default=0) <= stopped_ns

    def quiet():
        for published_ns in composed.outputs.values():
            published_ns.clear()
        composed.spin_for(0.5)
        return silence()

    def silence():
        return not any(composed.outputs[name] for name in silent)

    composed.spin_until(quiet)  # others finish the frame that they had
    composed.spin_until(lambda: all(
        published_ns for name, published_ns in composed.outputs.items() if name not in silent))
    assert silence()
    assert composed.fault(node, 'inactive').level == b'\x01'
    assert manager.change(node, Transition.TRANSITION_ACTIVATE)
    composed.spin_until(lambda: all(composed.outputs.values()))
    composed.healthy(node)


def test_a_node_that_is_cleaned_up_comes_back_as_it_was(composed):
    manager = Manager(composed)
    for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP):
        assert manager.change('depth_node', transition)
    assert manager.state('depth_node') == State.PRIMARY_STATE_UNCONFIGURED
    composed.spin_until(lambda: not composed.node.count_publishers('person_depth/people'))
    composed.fault('depth_node', 'unconfigured')
    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        assert manager.change('depth_node', transition)
    composed.outputs['depth_node'].clear()
    composed.spin_until(lambda: composed.outputs['depth_node'])
    composed.healthy('depth_node')


def test_a_transition_that_the_state_does_not_have_is_refused_and_harms_nothing(composed):
    manager = Manager(composed)
    assert not manager.change('pose_node', Transition.TRANSITION_CONFIGURE)
    assert manager.state('pose_node') == State.PRIMARY_STATE_ACTIVE
    composed.program.hears('from the state active; there are: deactivate')


def test_a_node_that_is_shut_down_is_silent_and_the_process_still_ends_in_order(composed):
    manager = Manager(composed)
    assert manager.change('camera_node', Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert manager.state('camera_node') == State.PRIMARY_STATE_FINALIZED
    composed.spin_until(lambda: not composed.node.count_publishers('camera_info'))
    composed.fault('depth_node', 'nothing came from pose_node')
    composed.program.interrupt()
    assert composed.program.exit_code(3) == 0
    assert 'Traceback' not in composed.program.said


def test_what_cannot_be_configured_says_why_and_can_be_tried_again(domain, tmp_path):
    program = domain.start(
        'pose_node', '--ros-args', '-p', 'autostart:=false', '-p', f'model:={tmp_path}/no.onnx',
        ready='is up, and unconfigured')
    manager = Manager(domain)
    for _ in range(2):
        assert not manager.change('pose_node', Transition.TRANSITION_CONFIGURE)
        assert manager.state('pose_node') == State.PRIMARY_STATE_UNCONFIGURED
        assert 'no.onnx' in domain.fault('pose_node', 'no.onnx').message
    program.interrupt()
    assert program.exit_code(3) == 0


def test_a_recording_that_cannot_be_opened_leaves_a_managed_node_inactive(domain, tmp_path):
    program = domain.start(
        'camera_node', '--ros-args', '-p', 'autostart:=false', '-p', f'source:={tmp_path}/no.mp4',
        ready='is up, and unconfigured')
    manager = Manager(domain)
    assert manager.change('camera_node', Transition.TRANSITION_CONFIGURE)
    for _ in range(2):
        assert manager.change('camera_node', Transition.TRANSITION_ACTIVATE)
        assert domain.fault('camera_node', 'no.mp4').level == b'\x02'
        domain.spin_until(lambda: manager.state('camera_node') == State.PRIMARY_STATE_INACTIVE)
    assert program.poll() is None


def test_without_autostart_nothing_is_published_until_it_is_told_to(domain, folder):
    domain.start(
        'camera_node', '--ros-args', '-p', 'autostart:=false', '-p', f'source:={folder}',
        '-p', 'loop:=true', ready='is up, and unconfigured')
    images = domain.listen(Image, 'image_raw')
    manager = Manager(domain)
    assert manager.state('camera_node') == State.PRIMARY_STATE_UNCONFIGURED
    assert manager.change('camera_node', Transition.TRANSITION_CONFIGURE)
    domain.spin_for(0.5)
    assert not images
    assert manager.change('camera_node', Transition.TRANSITION_ACTIVATE)
    domain.spin_until(lambda: images)
