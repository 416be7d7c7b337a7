"""Start camera_node, pose_node and depth_node, in one process or in one each."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """Return the three nodes; see `ros2 launch depth_person depth_person.launch.py -s`."""
    params_file = LaunchConfiguration('params_file')
    namespace = LaunchConfiguration('namespace')
    composed = LaunchConfiguration('composed')
    return LaunchDescription([
        DeclareLaunchArgument(
            'params_file',
            default_value=PathJoinSubstitution(
                [FindPackageShare('depth_person'), 'config', 'depth_person.yaml']),
            description='ROS 2 parameter file for all nodes'),
        DeclareLaunchArgument(
            'namespace', default_value='',
            description='namespace of all nodes and topics, one for each camera'),
        DeclareLaunchArgument(
            'composed', default_value='true',
            description='true: one process, frames are handed on in memory; false: three'),
        Node(
            package='depth_person', executable='depth_person', arguments=['run'],
            namespace=namespace, parameters=[params_file], output='screen',
            condition=IfCondition(composed)),
        *(
            Node(
                package='depth_person', executable=executable, name=executable,
                namespace=namespace, parameters=[params_file], output='screen',
                condition=UnlessCondition(composed))
            for executable in ('camera_node', 'pose_node', 'depth_node')),
    ])
