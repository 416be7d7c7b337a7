"""pose_node with networks from files, and with providers that are not here."""
import numpy as np
from sensor_msgs.msg import Image, PointCloud2

from depth_person.pose.store import model_path


def test_a_provider_that_is_not_here_is_a_warning_and_the_cpu_does_its_work(
        domain, photograph):
    # A network for one person, from its file: what kind it is has to be told by what it gives.
    program = domain.start(
        'pose_node', '--ros-args', '-p', 'provider:=cuda', '-p',
        f'model:={model_path("movenet-lightning")}')
    clouds = domain.listen(PointCloud2, 'person_keypoints')
    publisher = domain.publisher(Image, 'image_raw')
    height, width = photograph.shape[:2]
    message = Image(height=height, width=width, encoding='bgr8', step=3 * width)
    message.data = photograph.tobytes()
    domain.spin_until(lambda: publisher.publish(message) or domain.spin_for(0.2) or clouds)
    assert clouds[-1].height == 1
    domain.fault('pose_node', "runs on the CPU, slower: ONNX Runtime has no provider 'cuda'")
    assert "no provider 'cuda'" in program.said


def test_a_provider_that_is_not_here_ends_it_where_the_cpu_may_not_stand_in(domain):
    program = domain.start(
        'pose_node', '--ros-args', '-p', 'provider:=cuda', '-p', 'provider_fallback:=false',
        ready='allow the CPU with provider_fallback: true')
    assert program.exit_code() == 1
    assert 'Traceback' not in program.said


def test_a_file_of_no_known_network_ends_it_with_what_it_was(domain, tmp_path):
    path = tmp_path / 'net.onnx'
    path.write_bytes(np.arange(100, dtype=np.uint8).tobytes())
    program = domain.start(
        'pose_node', '--ros-args', '-p', f'model:={path}', ready=f'cannot open {path}')
    assert program.exit_code() == 1
    assert 'Traceback' not in program.said
