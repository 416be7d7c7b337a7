"""Start the pipeline beside MAVROS, and MAVROS itself when an autopilot is named."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import (
    LaunchConfiguration,
    NotEqualsSubstitution,
    PathJoinSubstitution,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile
from launch_ros.substitutions import FindPackageShare

#: Topic of ours -> topic of MAVROS in its default namespace.
TOPICS = {
    'person_depth/scan': '/mavros/obstacle/send',
    'imu': '/mavros/imu/data',
    'pose': '/mavros/local_position/pose',
    'odometry': '/mavros/local_position/odom',
    'rangefinder': '/mavros/rangefinder/rangefinder',
    'rel_alt': '/mavros/global_position/rel_alt',
}


def generate_launch_description():
    """Return the pipeline in one process; see `ros2 launch depth_person mavros.launch.py -s`."""
    share = FindPackageShare('depth_person')
    autopilot = LaunchConfiguration('autopilot')
    fcu_url = LaunchConfiguration('fcu_url')
    plugins = LaunchConfiguration('plugins_file')
    mavros = [
        ParameterFile([FindPackageShare('mavros'), '/launch/', autopilot, file])
        for file in ('_pluginlists.yaml', '_config.yaml')]
    return LaunchDescription([
        DeclareLaunchArgument(
            'params_file',
            default_value=PathJoinSubstitution([share, 'config', 'mavros.yaml']),
            description='ROS 2 parameter file for depth_person'),
        DeclareLaunchArgument(
            'plugins_file',
            default_value=PathJoinSubstitution([share, 'config', 'mavros_plugins.yaml']),
            description='ROS 2 parameter file for the plugins of MAVROS'),
        DeclareLaunchArgument(
            'fcu_url', default_value='',
            description='where the autopilot is, such as /dev/ttyAMA0:921600; empty when MAVROS '
            'has been started by someone else, with plugins_file'),
        DeclareLaunchArgument(
            'autopilot', default_value='px4', choices=['px4', 'apm'],
            description='px4, or apm for ArduPilot'),
        Node(
            package='depth_person', executable='depth_person', arguments=['run'],
            parameters=[LaunchConfiguration('params_file')], output='screen',
            remappings=list(TOPICS.items())),
        Node(
            package='mavros', executable='mavros_node', namespace='mavros', output='screen',
            parameters=[*mavros, plugins, {'fcu_url': fcu_url}],
            condition=IfCondition(NotEqualsSubstitution(fcu_url, ''))),
    ])
