"""The package builds with colcon as ament_python, and what it installs runs."""
from pathlib import Path
import signal
import subprocess
import sys

import pytest

REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(scope='module')
def workspace(tmp_path_factory):
    """Return a folder in which colcon built and installed the package."""
    folder = tmp_path_factory.mktemp('workspace')
    subprocess.run(
        [Path(sys.executable).parent / 'colcon', '--log-base', folder / 'log', 'build',
         '--base-paths', REPOSITORY, '--build-base', folder / 'build',
         '--install-base', folder / 'install', '--packages-select', 'depth_person'],
        cwd=folder, check=True, timeout=240)
    return folder / 'install' / 'depth_person'


@pytest.mark.parametrize('executable', [
    'camera_node', 'pose_node', 'depth_node', 'mavlink_node'])
def test_executables_are_where_ros2_run_looks(workspace, executable):
    assert (workspace / 'lib' / 'depth_person' / executable).stat().st_mode & 0o100


@pytest.mark.parametrize('folder', ['config', 'launch', 'msg_docs'])
def test_share_holds_every_file_of_the_repository(workspace, folder):
    def names(path):
        return {file.name for file in path.iterdir() if file.suffix in ('.md', '.py', '.yaml')}

    expected = names(REPOSITORY / folder)
    assert expected
    assert names(workspace / 'share' / 'depth_person' / folder) == expected


def test_package_is_in_the_ament_index(workspace):
    index = workspace / 'share' / 'ament_index' / 'resource_index' / 'packages'
    assert (index / 'depth_person').is_file()


def test_an_installed_executable_starts_and_ends_on_ctrl_c(workspace, ros_environment):
    started = 'depth_node is up'
    with subprocess.Popen(
            ['bash', '-c', f'source {workspace.parent}/setup.bash && '
             f'exec {workspace}/lib/depth_person/depth_node'],
            env=ros_environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True) as process:
        try:
            said = []
            for line in process.stdout:
                said.append(line)
                if started in line:
                    process.send_signal(signal.SIGINT)
            assert process.wait(timeout=60) == 0, ''.join(said)
        finally:
            process.kill()
    assert started in ''.join(said)
    assert 'Traceback' not in ''.join(said)
