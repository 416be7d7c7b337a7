"""Installs depth_person with pip, or with colcon as an ament_python package."""
from glob import glob
import os

from setuptools import find_packages, setup

package_name = 'depth_person'


def share(folder, *patterns):
    """Return one data_files entry that puts a folder's files under share/depth_person."""
    files = [path for pattern in patterns for path in sorted(glob(os.path.join(folder, pattern)))]
    return os.path.join('share', package_name, folder), files


setup(
    name=package_name,
    version='0.1.0',
    description='The distance of every visible person from one ordinary RGB camera.',
    author='depth_person developers',
    maintainer='depth_person developers',
    maintainer_email='depth-person@example.org',
    license='Apache-2.0',
    packages=find_packages(include=[package_name, package_name + '.*']),
    package_data={package_name: ['py.typed', 'camera/presets/*', 'distance/models/*']},
    python_requires='>=3.10,<3.14',
    install_requires=[
        'lz4>=4.0',
        'mcap>=1.2',
        'numpy>=1.26',
        'onnxruntime>=1.17',
        'opencv-python-headless>=4.6',
        'pyyaml>=6.0',
        'rosbags>=0.11',
        'tqdm>=4.66',
        'zstandard>=0.21',
    ],
    extras_require={
        'models': ['onnx>=1.16'],
        'ros': [
            'ros-jazzy-common-interfaces',
            'ros-jazzy-rclpy',
            'ros-jazzy-rmw-fastrtps-cpp',
        ],
        'mavlink': ['pymavlink>=2.4.41', 'pyserial>=3.5'],
        'demo': ['imageio-ffmpeg>=0.5', 'matplotlib>=3.8'],
        'train': [
            'anny>=0.6', 'onnx>=1.16', 'scikit-learn>=1.4', 'scipy>=1.11', 'skl2onnx>=1.17',
            'torch==2.13.0'],
        'test': [
            'brotli>=1.1',
            'colcon-common-extensions',
            'hypothesis>=6.100',
            'imageio-ffmpeg>=0.5',
            'matplotlib>=3.8',
            'mcap-ros2-support>=0.5',
            'mypy>=1.10',
            'onnx>=1.16',
            'pymavlink>=2.4.41',
            'pyserial>=3.5',
            'pytest>=8.0',
            'pytest-rerunfailures>=14.0',
            'pytest-timeout>=2.3',
            'pytest-xdist>=3.5',
            'ruff>=0.6',
            'scikit-image>=0.22',
            'scikit-learn>=1.4',
            'scipy>=1.11',
            'skl2onnx>=1.17',
        ],
    },
    data_files=[
        (os.path.join('share', 'ament_index', 'resource_index', 'packages'),
         [os.path.join('resource', package_name)]),
        (os.path.join('share', package_name), ['package.xml']),
        share('config', '*.yaml'),
        share('launch', '*.launch.py'),
        share('msg_docs', '*.md'),
    ],
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'depth_person = depth_person.cli:main',
            'camera_node = depth_person.nodes.executables:camera_node',
            'pose_node = depth_person.nodes.executables:pose_node',
            'depth_node = depth_person.nodes.executables:depth_node',
            'mavlink_node = depth_person.nodes.executables:mavlink_node',
        ],
    },
)
