"""Nodes in processes of their own, and a node of the test's that talks to them over DDS."""
from contextlib import contextmanager
import itertools
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import cv2
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from matplotlib import cbook
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

#: Which of the processes that run tests side by side this one is; each has every other domain.
_WORKER = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw')) % 2
#: Domains above 101 meet the ports that Linux gives to outgoing connections.
DOMAINS = itertools.cycle(range(2 * (1 + os.getppid() % 25) + _WORKER, 100, 2))


class Program:
    """A started executable and what it has said so far."""

    def __init__(self, command, environment, log):
        self._log = log
        with log.open('wb') as stream:
            self._process = subprocess.Popen(
                [Path(sys.executable).parent / command[0], *command[1:]], env=environment,
                stdout=stream, stderr=subprocess.STDOUT)

    @property
    def said(self):
        return self._log.read_text(errors='replace')  # a letter may be half written

    def hears(self, text, timeout_s=60.0):
        """Wait until the program has said a text."""
        deadline = time.monotonic() + timeout_s
        while text not in self.said:
            assert time.monotonic() < deadline, f'{text!r} is not in:\n{self.said}'
            assert self._process.poll() is None or text in self.said, self.said
            time.sleep(0.02)

    def interrupt(self, number=signal.SIGINT):
        self._process.send_signal(number)

    def poll(self):
        return self._process.poll()

    def exit_code(self, timeout_s=30.0):
        return self._process.wait(timeout_s)

    def end(self, timeout_s=3.0):
        """Wait for the end of a program that is interrupted; kill it if it does not come."""
        try:
            self.exit_code(timeout_s)
        except subprocess.TimeoutExpired:
            self.kill()

    def kill(self):
        self._process.kill()
        self._process.wait()


class Domain:
    """One ROS domain: starts programs in it, and takes part through a node."""

    def __init__(self, folder):
        self.number = next(DOMAINS)
        self.environment = {**os.environ, 'ROS_DOMAIN_ID': str(self.number)}
        self._folder = folder
        self._programs = []
        self._context = Context()
        self._context.init(domain_id=self.number)
        self.node = Node(f'test_{self.number}', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def start(self, *command, ready=' is up', **parameters):
        """Start an executable, with parameters of a node; return once it has said it is ready."""
        log = self._folder / f'{len(self._programs)}_{command[0]}.log'
        words = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
        if words:
            words.insert(0, '--ros-args')
        program = Program([str(word) for word in (*command, *words)], self.environment, log)
        self._programs.append(program)
        program.hears(ready)
        return program

    def listen(self, message_type, topic, qos=10):
        """Return a list that fills with the messages of a topic while the domain spins."""
        messages = []
        self.node.create_subscription(message_type, topic, messages.append, qos)
        return messages

    def publisher(self, message_type, topic, qos=10, subscribers=1):
        """Return a publisher that has found its subscribers."""
        publisher = self.node.create_publisher(message_type, topic, qos)
        self.spin_until(lambda: publisher.get_subscription_count() >= subscribers)
        self.spin_for(0.3)  # and they the publisher, which nobody can ask
        return publisher

    def spin_until(self, done, timeout_s=60.0):
        """Spin until a condition holds; fail if it does not in time."""
        deadline = time.monotonic() + timeout_s
        while not done():
            assert time.monotonic() < deadline, self._all_said()
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds, unless=lambda: False):
        """Spin for a time, or until a condition holds."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and not unless():
            self._executor.spin_once(timeout_sec=0.05)

    def status(self, node, matches=lambda status: True):
        """Return the first diagnostics of a node from now on that match."""
        arrays = self.listen(DiagnosticArray, '/diagnostics')

        def found():
            return [status for array in arrays for status in array.status
                    if status.name == node and matches(status)]

        self.spin_until(found)
        return found()[0]

    def fault(self, node, text):
        """Wait until the diagnostics of a node show a fault."""
        return self.status(node, lambda status: text in status.message)

    def healthy(self, node):
        """Wait until the diagnostics of a node show no fault."""
        return self.status(node, lambda status: status.level == DiagnosticStatus.OK)

    def set_parameter(self, node, name, value):
        """Set a parameter as `ros2 param set` does; return the result."""
        kinds = {bool: ('bool', ParameterType.PARAMETER_BOOL),
                 int: ('integer', ParameterType.PARAMETER_INTEGER),
                 float: ('double', ParameterType.PARAMETER_DOUBLE),
                 str: ('string', ParameterType.PARAMETER_STRING)}
        field, kind = kinds[type(value)]
        client = self.node.create_client(SetParameters, f'{node}/set_parameters')
        self.spin_until(client.service_is_ready)
        answer = client.call_async(SetParameters.Request(parameters=[Parameter(
            name=name, value=ParameterValue(type=kind, **{f'{field}_value': value}))]))
        self.spin_until(answer.done)
        return answer.result().results[0]

    def close(self):
        # Killed programs would leave their shared memory behind, of which containers have little.
        for program in self._programs:
            program.interrupt()
        for program in self._programs:
            program.end()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def _all_said(self):
        return '\n'.join(program.said for program in self._programs)


@contextmanager
def open_domain(folder):
    domain = Domain(folder)
    try:
        yield domain
    finally:
        domain.close()


@pytest.fixture
def domain(tmp_path):
    """Return a ROS domain of the test's own."""
    with open_domain(tmp_path) as result:
        yield result


@pytest.fixture
def other_domain(tmp_path_factory):
    """Return a second ROS domain of the test's own."""
    with open_domain(tmp_path_factory.mktemp('other_domain')) as result:
        yield result


@pytest.fixture(scope='module')
def shared_domain(tmp_path_factory):
    """Return a ROS domain that the tests of a module share."""
    with open_domain(tmp_path_factory.mktemp('domain')) as result:
        yield result


@pytest.fixture(scope='session')
def photograph():
    """Return a BGR photograph of one person, both shoulders in view."""
    return cv2.imread(str(cbook.get_sample_data('grace_hopper.jpg', asfileobj=False)))


@pytest.fixture(scope='session')
def folder(photograph, tmp_path_factory):
    """Return a folder of ten frames of the photograph, which moves a little."""
    result = tmp_path_factory.mktemp('frames')
    for index in range(10):
        frame = cv2.copyMakeBorder(
            photograph, 0, 0, 4 * index, 40 - 4 * index, cv2.BORDER_REPLICATE)
        cv2.imwrite(str(result / f'{index:02}.png'), frame)
    return result
