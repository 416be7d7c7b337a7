"""The reading examples of msg_docs run, and the README's topics are those that are published."""
from pathlib import Path
import re
import subprocess
import sys

import pytest

REPOSITORY = Path(__file__).parents[2]
PAGES = sorted((REPOSITORY / 'msg_docs').glob('*.md'))
NODES = ('camera_node', 'pose_node', 'depth_node')
#: What every (lifecycle) node of ROS 2 publishes.
FOREIGN_TOPICS = ('/rosout', '/parameter_events', *(f'/{node}/transition_event' for node in NODES))


def examples(page):
    """Return the programs on a page."""
    return re.findall(r'^```python\n(.*?)^```', page.read_text(), re.MULTILINE | re.DOTALL)


EXAMPLES = [
    pytest.param(program, id=f'{page.stem}-{index}')
    for page in PAGES for index, program in enumerate(examples(page))]


@pytest.fixture(scope='module')
def pipeline(shared_domain):
    """Return a domain in which the demo's scene is measured over and over."""
    shared_domain.start(
        'depth_person', 'run', '--source', REPOSITORY / 'demo' / 'walk', '--loop',
        '--ros-args', '-p', 'max_age:=0.0',
        ready='camera_node is up')
    return shared_domain


@pytest.mark.parametrize('program', EXAMPLES)
def test_an_example_reads_its_topic(pipeline, program, tmp_path):
    run = subprocess.run(
        [sys.executable, '-c', program], env=pipeline.environment, cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60)
    assert run.returncode == 0, run.stdout
    assert run.stdout.strip()
    assert 'Traceback' not in run.stdout


def test_every_topic_has_a_page_with_an_example():
    index = (REPOSITORY / 'msg_docs' / 'README.md').read_text()
    linked = set(re.findall(r'^\| `.*\]\((\w+\.md)\)', index, re.MULTILINE))
    assert len(linked) >= 6
    assert all(examples(REPOSITORY / 'msg_docs' / page) for page in linked)


def test_the_topics_of_the_readme_are_those_of_the_nodes(pipeline):
    rows = re.findall(
        r'^\| \[`(/?[\w/]+)`\]\(.*?\) \| `([\w/]+)` \| (`\w+`|each node) \|',
        (REPOSITORY / 'README.md').read_text(), re.MULTILINE)
    documented = {
        (node, '/' + topic.lstrip('/'), kind)
        for topic, kind, publisher in rows
        for node in (NODES if publisher == 'each node' else [publisher.strip('`')])}

    def published():
        return {
            (node, topic, kinds[0]) for node in NODES
            for topic, kinds in pipeline.node.get_publisher_names_and_types_by_node(node, '/')
            if topic not in FOREIGN_TOPICS}

    pipeline.spin_until(lambda: len(published()) >= len(documented))
    assert published() == documented
