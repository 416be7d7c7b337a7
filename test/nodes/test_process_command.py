"""The command process with the networks: the same bytes every time, stopped and gone on with."""
from dataclasses import replace
import hashlib
import itertools
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from depth_person.camera.bag import BagReader
from depth_person.cli import main
from depth_person.replay.bags import BagWriter, jazzy_types
from depth_person.replay.clouds import cloud_points
from depth_person.replay.input_bags import InputBags
from depth_person.replay.unfinished import RunRecord

String = jazzy_types().types['std_msgs/msg/String']
WALK = Path(__file__).parents[2] / 'demo/walk'
FRAMES = 14
#: Fills the file's buffer every few frames, so that a killed run leaves something.
BALLAST = String(data=250_000 * 'x')
RESULTS = ['/person_keypoints', '/person_depth/people', '/person_depth', '/person_depth/scan',
           '/person_depth/nearest', '/person_depth/target']


@pytest.fixture(scope='module')
def walk(tmp_path_factory):
    """Return a bag of the demo's first frames."""
    path = tmp_path_factory.mktemp('bags') / 'walk'
    with BagReader(WALK) as source, BagWriter(path) as writer:
        for topic in source.topics.values():
            writer.add_topic(topic.name, topic.msgtype, qos=topic.qos)
        frames = 0
        for topic, time_ns, data in source.raw_messages():
            writer.write_raw(topic, time_ns, data)
            if topic == '/image_raw/compressed':
                writer.write('/ballast', time_ns, BALLAST)
                frames += 1
            if frames == FRAMES:
                break
    return path


@pytest.fixture(scope='module')
def processed(walk):
    """Return what process makes of it."""
    out = walk.with_name('processed')
    assert main(['process', str(walk), '-o', str(out), '--quiet']) == 0
    return out


def write_images(path, count):
    """Write a bag of the demo's first images without their CameraInfo; return its path."""
    topic = '/image_raw/compressed'
    with BagReader(WALK) as source, BagWriter(path) as writer:
        writer.add_topic(topic, source.topics[topic].msgtype)
        for _, time_ns, data in itertools.islice(source.raw_messages([topic]), count):
            writer.write_raw(topic, time_ns, data)
    return path


def digest(bag):
    """Return one number for the topics, times and bytes of a bag."""
    total = hashlib.sha256()
    with BagReader(bag) as reader:
        assert reader.damage is None
        for topic, time_ns, data in reader.raw_messages():
            total.update(f'{topic} {time_ns} '.encode() + data)
    return total.hexdigest()


def test_results_carry_the_stamps_and_times_of_their_frames(processed):
    with BagReader(processed) as reader:
        headers, times = {}, {}
        assert reader.topics['/ballast'].count == FRAMES
        for topic, time_ns, message in reader.messages(reader.topics.keys() - {'/ballast'}):
            first = message.markers[0] if topic == '/person_depth' else message
            headers.setdefault(topic, []).append((first.header.stamp, first.header.frame_id))
            times.setdefault(topic, []).append(time_ns)
    images = headers['/image_raw/compressed']
    assert len(images) == FRAMES
    for topic in RESULTS[:3]:
        assert headers[topic] == images
        assert times[topic] == times['/image_raw/compressed']
    assert set(headers) == {'/image_raw/compressed', '/camera_info', '/person_truth', *RESULTS}


def test_the_people_are_where_the_truth_says(processed):
    with BagReader(processed) as reader:
        truths, found = ([
            cloud_points(message)[0] for _, _, message in reader.messages([topic])]
            for topic in ('/person_truth', '/person_depth/people'))
    errors = []
    for truth, people in zip(truths, found, strict=True):
        for person in truth:
            apart = np.abs(people['range'] - person['range']) / person['range']
            errors.append(np.nanmin(apart))
    assert np.median(errors) < 0.1


def test_the_same_bag_gives_the_same_bytes_on_a_busy_machine(walk, processed, tmp_path):
    done = threading.Event()

    def burn():
        while not done.is_set():
            sum(range(10_000))

    threads = [threading.Thread(target=burn) for _ in range(3)]
    for thread in threads:
        thread.start()
    try:
        assert main(['process', str(walk), '-o', str(tmp_path / 'out'), '--quiet']) == 0
    finally:
        done.set()
        for thread in threads:
            thread.join()

    assert digest(tmp_path / 'out') == digest(processed)


@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_run_is_readable_and_goes_on_to_the_same_bytes(
        walk, processed, tmp_path, stop):
    out = tmp_path / 'out'
    command = [str(Path(sys.executable).parent / 'depth_person'), 'process', str(walk),
               '-o', str(out), '--quiet']
    child = subprocess.Popen(command, stderr=subprocess.PIPE)
    try:
        while not (out / 'out.mcap').exists() or (out / 'out.mcap').stat().st_size < 10_000:
            assert child.poll() is None
            time.sleep(0.01)
        child.send_signal(stop)
        _, said = child.communicate(timeout=60)
    finally:
        child.kill()

    assert child.returncode == (130 if stop == signal.SIGINT else -signal.SIGKILL)
    assert b'Traceback' not in said
    with BagReader(out) as reader:
        before = len(list(reader.messages(['/person_keypoints'])))
        assert (reader.damage is None) == (stop == signal.SIGINT)
    assert 0 < before < FRAMES
    assert main([*command[1:], '--resume']) == 0
    assert digest(out) == digest(processed)
    assert [path.name for path in tmp_path.iterdir()] == ['out']


def test_a_run_that_was_killed_before_anything_was_written_begins_anew(tmp_path):
    out = tmp_path / 'out'
    arguments = ['process', str(write_images(tmp_path / 'bag', 1)), '-o', str(out), '--quiet']
    assert main(arguments) == 3
    before = digest(out)
    (out / 'out.mcap').write_bytes(b'')
    (out / 'metadata.yaml').unlink()
    replace(RunRecord.read(out), finished=False).write(out)

    assert main([*arguments, '--resume']) == 3

    assert digest(out) == before
    assert not (tmp_path / 'out.before').exists()


def test_nothing_is_overwritten_unasked_and_only_the_same_run_goes_on(
        walk, processed, capsys):
    arguments = ['process', str(walk), '-o', str(processed)]
    before = digest(processed)

    assert main(arguments) == 1
    assert 'exists already' in capsys.readouterr().err
    assert main([*arguments, '--resume', '--estimator', 'shoulder']) == 1
    assert 'begun with another depth_node.estimator;' in capsys.readouterr().err
    assert main([*arguments, '--resume']) == 0
    assert 'is finished already' in capsys.readouterr().out
    assert digest(processed) == before


def test_overwrite_refuses_what_it_has_not_written(walk, tmp_path, capsys):
    (tmp_path / 'home').mkdir()
    (tmp_path / 'home/thesis.txt').touch()

    assert main(['process', str(walk), '-o', str(tmp_path / 'home'), '--overwrite']) == 1

    assert 'is no bag of results; it is not overwritten' in capsys.readouterr().err
    assert (tmp_path / 'home/thesis.txt').exists()


@pytest.mark.parametrize('option', [[], ['--overwrite'], ['--resume']])
@pytest.mark.parametrize(('read', 'out', 'said'), [
    ('flight', 'flight', 'is one of the bags'),
    ('flight', 'flight/results', 'lies within'),
    ('flight/flight.mcap', 'flight', 'lies within'),
    ('flight.before', 'flight', 'is one of the bags'),
    ('flight.before/flight.before.mcap', 'flight', 'lies within'),
    ('flight', '.', 'is no name for a new folder'),
])
def test_nothing_that_is_read_is_written_to(
        tmp_path, monkeypatch, capsys, option, read, out, said):
    monkeypatch.chdir(tmp_path)
    bag = Path(read) if Path(read).suffix != '.mcap' else Path(read).parent
    with BagWriter(bag) as writer:
        writer.write('/note', 1, String(data='precious'))
    before = sorted(path.read_bytes() for path in bag.iterdir())

    assert main(['process', read, '-o', out, *option]) == 1

    assert said in capsys.readouterr().err
    assert sorted(path.read_bytes() for path in bag.iterdir()) == before
    assert list(Path().iterdir()) == [bag]


@pytest.mark.parametrize('record', [
    None, '{', '{"settings": [], "finished": false}', '{"settings": {}, "faults": "none"}'])
def test_resume_offers_overwrite_where_that_is_done(tmp_path, capsys, record):
    arguments = ['process', str(write_images(tmp_path / 'bag', 1)), '-o', str(tmp_path / 'out')]
    (tmp_path / 'out').mkdir()
    if record is not None:
        (tmp_path / 'out/process.json').write_text(record)

    assert main([*arguments, '--resume']) == 1
    said = capsys.readouterr().err
    assert 'process.json' in said
    offered = '--overwrite' in said

    assert offered == (record is not None)
    assert (main([*arguments, '--overwrite']) == 1) == (not offered)


@pytest.mark.parametrize('name', ['flight', 'flight.before'])
def test_overwrite_refuses_a_recording(walk, tmp_path, capsys, name):
    with BagWriter(tmp_path / name) as writer:
        writer.write('/note', 1, String(data='precious'))

    assert main(['process', str(walk), '-o', str(tmp_path / 'flight'), '--overwrite']) == 1

    assert 'is no bag of results; it is not overwritten' in capsys.readouterr().err
    with BagReader(tmp_path / name) as reader:
        assert len(list(reader.messages())) == 1


def test_a_finished_bag_is_not_that_of_another_input(processed, tmp_path, capsys):
    other = write_images(tmp_path / 'other', 1)

    assert main(['process', str(other), '-o', str(processed), '--resume']) == 1

    assert 'begun with another input.messages./ballast, ' in capsys.readouterr().err


def test_bags_are_told_apart_by_their_first_image(tmp_path):
    found = []
    for name in ('a', 'b'):
        with BagWriter(tmp_path / name) as writer:
            writer.write('/image', 1, String(data=f'{name} stands for an image'))
        with InputBags([tmp_path / name]) as bags:
            found.append(bags.identity('/image'))
    assert found[0]['messages'] == found[1]['messages'] == {'/image': 1}
    assert found[0]['first_image'] != found[1]['first_image']


def test_what_a_finished_run_could_not_use_is_told_again(tmp_path, capsys):
    arguments = ['process', str(write_images(tmp_path / 'bag', 1)), '-o', str(tmp_path / 'out')]
    assert main(arguments) == 3
    first = capsys.readouterr().err

    assert main([*arguments, '--resume']) == 3

    said = capsys.readouterr()
    assert 'is finished already' in said.out
    assert '1 frames are uncalibrated' in first
    assert said.err == first


def test_a_topic_without_images_is_told(tmp_path, capsys):
    bag = write_images(tmp_path / 'bag', 0)

    assert main(['process', str(bag), '-o', str(tmp_path / 'out')]) == 3

    assert 'there is no image' in capsys.readouterr().err


def test_other_tools_read_the_results_by_their_embedded_definitions(processed):
    file, = processed.glob('*.mcap')
    with file.open('rb') as stream:
        decoded = list(make_reader(
            stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    with AnyReader([processed]) as reader:
        same = [(connection.topic, reader.deserialize(raw, connection.msgtype))
                for connection, _, raw in reader.messages()]

    assert len(decoded) == len(same) == FRAMES * (4 + len(RESULTS))
    markers = next(each for _, channel, _, each in decoded if channel.topic == '/person_depth')
    other = next(message for topic, message in same if topic == '/person_depth')
    assert len(markers.markers) == len(other.markers) > 3
    assert markers.markers[1].pose.position.z == other.markers[1].pose.position.z


def test_what_could_not_be_used_decides_the_exit_code(walk, tmp_path, capsys):
    torn = tmp_path / 'torn.mcap'
    data = next(walk.glob('*.mcap')).read_bytes()
    torn.write_bytes(data[:len(data) // 4])

    assert main(['process', str(torn), '-o', str(tmp_path / 'out')]) == 3

    said = capsys.readouterr()
    assert 'torn.mcap is cut off or damaged' in said.err
    assert 'frames with' in said.out
    with BagReader(tmp_path / 'out') as reader:
        assert reader.damage is None
        assert reader.topics['/person_keypoints'].count > 2


def test_a_place_that_cannot_be_looked_at_is_told(walk, tmp_path, capsys):
    long = tmp_path / ('x' * 300)

    assert main(['process', str(walk), '-o', str(long)]) == 1

    assert 'cannot be written: ' in capsys.readouterr().err


@pytest.mark.parametrize(('option', 'fault'), [
    (['--image-topic', '/camera_info'], 'which is no image topic'),
    (['--image-topic', '/top'], 'no image topic /top; it has /image_raw/compressed'),
    (['--camera-info-topic', '/person_truth'], 'which is no camera_info topic'),
    (['--remap', 'imu'], '--remap imu does not read FROM:=TO'),
    (['--remap', 'imus:=/imu'], '--remap imus: depth_node has no such input; it has imu, pose, '),
    (['--params', 'none.yaml'], 'none.yaml cannot be read'),
])
def test_wrong_options_are_told_before_anything_is_written(
        walk, tmp_path, capsys, option, fault):
    assert main(['process', str(walk), '-o', str(tmp_path / 'out'), *option]) == 1

    assert fault in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize('namespace', ['a b', '1st', 'a//b'])
def test_a_namespace_that_ros_does_not_know_is_refused(walk, tmp_path, capsys, namespace):
    with pytest.raises(SystemExit) as caught:
        main(['process', str(walk), '-o', str(tmp_path / 'out'), '--namespace', namespace])
    assert caught.value.code == 2
    assert 'argument --namespace: Invalid namespace' in capsys.readouterr().err


def test_a_parameter_file_and_a_namespace_are_obeyed(walk, tmp_path):
    params = tmp_path / 'params.yaml'
    params.write_text(
        '/front/depth_node: {ros__parameters: {max_range: 1.0}}\n'
        '/**: {ros__parameters: {model: movenet-multipose}}\n')

    assert main(['process', str(walk), '-o', str(tmp_path / 'out'), '--params', str(params),
                 '--namespace', 'front', '--without-images', '--quiet']) == 0

    with BagReader(tmp_path / 'out') as reader:
        assert '/image_raw/compressed' not in reader.topics
        people = [cloud_points(message)[0] for _, _, message in
                  reader.messages(['/front/person_depth/people'])]
    assert len(people) == FRAMES
    assert all(map(len, people))
    assert all(np.isnan(each['range']).all() for each in people), 'nobody is nearer than 1 m'
