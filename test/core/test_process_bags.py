"""What process does with bags, whole and faulty, with a network that only looks at brightness."""
from collections import Counter
import itertools
import sys
import time

from bag_kinds import LATCHED, types_with
from bag_messages import camera_info, compressed, header, image, K, new, picture, string
import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from depth_person.camera.bag import BagReader
from depth_person.distance.stage import DistanceOptions, DistanceStage
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People
from depth_person.replay.bags import BagWriter, jazzy_types
from depth_person.replay.input_bags import InputBags
from depth_person.replay.process import Job, Processor, ResultTopic
from depth_person.replay.surroundings import Surroundings
from depth_person.replay.unfinished import RecordedPeople
from depth_person.settings.depth import DepthSettings

SECOND = 10**9


def stamp(index):
    return 1000 * SECOND + index * SECOND // 10


class Brightness:
    """A pipeline that finds one person, whose first keypoint is the brightness of the image."""

    def __init__(self):
        self._distance = DistanceStage(DistanceOptions())
        self.looked = 0

    def find(self, frame):
        self.looked += 1
        keypoints = np.full((1, 18, 3), np.nan, np.float32)
        keypoints[0, 0] = round(float(frame.image.mean())), 0.0, 1.0
        return self.recall(frame, keypoints, np.ones(1, np.int32))

    def recall(self, frame, keypoints, track_ids):
        return People(keypoints, track_ids)

    def measure(self, frame, people, mounting, *, camera_pose):
        return self._distance.measure(
            people, frame.intrinsics, mounting, stamp_ns=frame.stamp_ns)


class TextCodec:
    """Writes a text of each frame."""

    topics = {'/seen': ResultTopic('std_msgs/msg/String', (LATCHED,))}  # noqa: RUF012

    def encode(self, frame, people, tracked, camera):
        calibrated = 'calibrated' if frame.intrinsics else 'uncalibrated'
        text = (f'{frame.stamp_ns} {frame.frame_id} {people.keypoints[0, 0, 0]:.0f} '
                f'{calibrated}')
        yield '/seen', jazzy_types().serialize_cdr(string(text), 'std_msgs/msg/String')


def process(*bags, out, pipeline=None, image_topic='/image', info_topic='/camera_info',
            copy_images=True, **options):
    """Process bags; return the outcome."""
    with InputBags(bags) as opened, BagWriter(out) as writer:
        if info_topic not in opened.topics:
            info_topic = None
        processor = Processor(
            opened, Job(image_topic, info_topic, copy_images), pipeline=pipeline or Brightness(),
            codec=TextCodec(), surroundings=Surroundings(opened, DepthSettings()),
            recollection=RecordedPeople(None, '/none'))
        return processor.run(writer, **options)


def messages_of(bag):
    with BagReader(bag) as reader:
        assert reader.damage is None
        return list(reader.raw_messages())


def seen_in(bag):
    """Return the texts on /seen, split into words."""
    with BagReader(bag) as reader:
        return [message.data.split() for _, _, message in reader.messages(['/seen'])]


def write(path, *records):
    """Write topic, time and message into a bag."""
    with BagWriter(path) as writer:
        for topic, time_ns, message in records:
            writer.write(topic, time_ns, message)
    return path


def walk(count=4, *, info=True):
    """Yield the records of a camera's bag, and a text a frame."""
    for index in range(count):
        if info:
            yield '/camera_info', stamp(index), camera_info(stamp(index))
        yield '/text', stamp(index) + 1, string(f'at {index}')
        yield '/image', stamp(index) + 7, image(stamp(index), picture(10 * (index % 20)))


def noisy_walk(count):
    """Yield the records of a camera whose images cannot be compressed."""
    noise = np.random.default_rng(1).integers(0, 21, (count, 120, 160, 3), np.uint8)
    for index, grain in enumerate(noise):
        noisy = grain + np.uint8(10 * index)
        yield '/text', stamp(index) + 1, string(f'at {index}')
        yield '/image', stamp(index) + 7, image(stamp(index), noisy)


def test_results_stand_beside_the_untouched_messages_at_the_time_of_their_frame(tmp_path):
    bag = write(tmp_path / 'in', *walk())

    outcome = process(bag, out=tmp_path / 'out')

    assert (outcome.frames, outcome.people, outcome.faults, outcome.finished) == (4, 4, [], True)
    found = messages_of(tmp_path / 'out')
    assert [each for each in found if each[0] != '/seen'] == messages_of(bag)
    assert seen_in(tmp_path / 'out') == [
        [str(stamp(index)), 'bag_optical_frame', str(10 * index), 'calibrated']
        for index in range(4)]
    assert [time_ns for topic, time_ns, _ in found if topic == '/seen'] == [
        stamp(index) + 7 for index in range(4)]


def test_images_can_be_left_out(tmp_path):
    bag = write(tmp_path / 'in', *walk())

    process(bag, out=tmp_path / 'out', copy_images=False)

    assert Counter(topic for topic, _, _ in messages_of(tmp_path / 'out')) == {
        '/camera_info': 4, '/text': 4, '/seen': 4}


def test_profiles_and_definitions_go_along_also_of_types_that_nobody_here_knows(tmp_path):
    types = types_with('my_msgs/msg/Pair', 'string name\nfloat64 value')
    pair = types.types['my_msgs/msg/Pair'](name='wind', value=3.5)
    with BagWriter(tmp_path / 'in', types=types) as writer:
        writer.add_topic('/pair', 'my_msgs/msg/Pair', qos=[LATCHED])
        writer.write('/pair', stamp(0), pair)
        writer.write('/image', stamp(0), image(stamp(0), picture(1)))

    process(tmp_path / 'in', out=tmp_path / 'out')

    with BagReader(tmp_path / 'in') as before, BagReader(tmp_path / 'out') as after:
        assert after.topics['/pair'] == before.topics['/pair']
        assert after.topics['/pair'].qos == after.topics['/seen'].qos == (LATCHED,)
        (_, _, message), = after.messages(['/pair'])
        assert (message.name, message.value) == ('wind', 3.5)


def test_results_of_an_earlier_run_are_replaced(tmp_path):
    write(tmp_path / 'in', ('/seen', stamp(0), string('old')), *walk())

    outcome = process(tmp_path / 'in', out=tmp_path / 'out')

    assert outcome.notes == [f'/seen of bag {tmp_path}/in is replaced']
    assert ['old'] not in seen_in(tmp_path / 'out')


def test_several_bags_are_merged_by_time(tmp_path):
    camera = write(tmp_path / 'camera', *walk())
    rest = write(tmp_path / 'rest', *(
        ('/wind', stamp(index) + 3, string(str(index))) for index in range(4)))

    process(camera, rest, out=tmp_path / 'out')

    topics = [topic for topic, _, _ in messages_of(tmp_path / 'out')]
    assert topics == ['/camera_info', '/text', '/wind', '/image', '/seen'] * 4


class Restless(Brightness):
    """Takes now long and now short over a frame."""

    def __init__(self, pauses):
        super().__init__()
        self._pauses = itertools.cycle(pauses)

    def find(self, frame):
        time.sleep(next(self._pauses))
        return super().find(frame)


def test_the_written_file_is_the_same_however_long_the_stages_take(tmp_path):
    bag = write(tmp_path / 'in', *walk(20))

    for name, pauses in (('a', [0.0]), ('b', [0.0, 0.02, 0.001]), ('c', [0.01, 0.0, 0.0, 0.03])):
        (tmp_path / name).mkdir()
        process(bag, out=tmp_path / name / 'out', pipeline=Restless(pauses))

    written = [(tmp_path / name / 'out/out.mcap').read_bytes() for name in 'abc']
    assert written[0] == written[1] == written[2]


def test_stages_take_short_turns_as_long_as_they_run(tmp_path):
    usual, turns = sys.getswitchinterval(), []

    process(write(tmp_path / 'walk', *walk()), out=tmp_path / 'out',
            on_frame=lambda: turns.append(sys.getswitchinterval()))

    assert turns
    assert max(turns) < usual == sys.getswitchinterval()


def test_what_was_done_until_a_stop_can_be_read(tmp_path):
    bag = write(tmp_path / 'in', *walk(50))
    frames = itertools.count(1)

    outcome = process(bag, out=tmp_path / 'out', stopping=lambda: next(frames) == 5)

    assert not outcome.finished
    assert outcome.frames == len(seen_in(tmp_path / 'out')) == 5
    assert messages_of(tmp_path / 'out')


def test_an_error_in_the_middle_ends_every_stage_and_leaves_what_was_done(tmp_path):
    class Failing(Brightness):
        def find(self, frame):
            if self.looked == 3:
                raise RuntimeError('out of memory')
            return super().find(frame)

    bag = write(tmp_path / 'in', *walk(50))

    with pytest.raises(RuntimeError, match='out of memory'):
        process(bag, out=tmp_path / 'out', pipeline=Failing())

    assert len(seen_in(tmp_path / 'out')) in (2, 3)


@pytest.mark.parametrize(('broken', 'fault'), [
    (image(stamp(9), picture(0), encoding='infrared9'), "image encoding 'infrared9'"),
    (new('sensor_msgs/msg/Image', header=header(0), height=480, width=640, encoding='bgr8',
         is_bigendian=0, step=1920, data=np.zeros(5, np.uint8)), 'data of 5 bytes is too short'),
])
def test_images_that_are_none_are_named_and_counted(tmp_path, broken, fault):
    bag = write(tmp_path / 'in', *walk(2), ('/image', stamp(9), broken),
                ('/image', stamp(10), broken))

    outcome = process(bag, out=tmp_path / 'out')

    assert outcome.frames == 2
    sentence, = outcome.faults
    assert sentence.startswith('2 images cannot be decoded')
    assert fault in sentence
    assert len([topic for topic, _, _ in messages_of(tmp_path / 'out') if topic == '/image']) == 4


def test_messages_that_do_not_decode_are_copied_named_and_counted(tmp_path):
    with BagWriter(tmp_path / 'in') as writer:
        for topic, time_ns, message in walk(3):
            writer.write(topic, time_ns, message)
        for index in range(2):
            writer.write_raw('/image', stamp(5 + index), b'\0\1\0\0 no image at all')

    outcome = process(tmp_path / 'in', out=tmp_path / 'out')

    assert outcome.frames == 3
    assert outcome.faults == ['2 messages on /image cannot be decoded']
    assert messages_of(tmp_path / 'out')[-1][2] == b'\0\1\0\0 no image at all'


def test_images_without_camera_info_are_looked_at_and_counted(tmp_path):
    bag = write(tmp_path / 'in', *walk(3, info=False))

    outcome = process(bag, out=tmp_path / 'out')

    assert {words[3] for words in seen_in(tmp_path / 'out')} == {'uncalibrated'}
    assert outcome.faults == ['3 frames are uncalibrated, so their people have no distance']


def test_a_camera_info_that_comes_later_counts_for_the_images_before_it(tmp_path):
    bag = write(tmp_path / 'in', *walk(3, info=False),
                ('/camera_info', stamp(5), camera_info(stamp(5))))

    outcome = process(bag, out=tmp_path / 'out')

    assert {words[3] for words in seen_in(tmp_path / 'out')} == {'calibrated'}
    assert outcome.faults == []


@pytest.mark.parametrize('wrong', [
    {'k': (float('nan'), *K[1:])}, {'width': 640, 'height': 480}])
def test_camera_infos_that_cannot_be_right_are_counted(tmp_path, wrong):
    bag = write(tmp_path / 'in', ('/camera_info', stamp(0), camera_info(0, **wrong)),
                *walk(3, info=False))

    outcome = process(bag, out=tmp_path / 'out')

    assert outcome.frames == 3
    assert any('CameraInfo messages cannot be used' in fault for fault in outcome.faults)
    assert any('3 frames are uncalibrated' in fault for fault in outcome.faults)


def test_stamps_of_zero_give_way_to_the_time_of_recording(tmp_path):
    bag = write(tmp_path / 'in', *(
        ('/image', stamp(index), image(0, picture(1))) for index in range(3)))

    outcome = process(bag, out=tmp_path / 'out')

    assert [int(words[0]) for words in seen_in(tmp_path / 'out')] == [
        stamp(index) for index in range(3)]
    assert any(fault.startswith('3 frames have a stamp of zero') for fault in outcome.faults)


def test_stamps_that_go_back_are_counted_and_their_frames_processed(tmp_path):
    order = [5, 6, 7, 1, 2, 6]
    bag = write(tmp_path / 'in', *(
        ('/image', stamp(index), image(stamp(number), picture(1)))
        for index, number in enumerate(order)))

    outcome = process(bag, out=tmp_path / 'out')

    assert [int(words[0]) for words in seen_in(tmp_path / 'out')] == [
        stamp(number) for number in order]
    assert any(fault.startswith('1 frames have a stamp before') for fault in outcome.faults)


def test_stamps_that_come_again_are_counted_and_their_frames_processed(tmp_path):
    order = [5, 6, 6, 7, 5]
    bag = write(tmp_path / 'in', *walk(1), *(
        ('/image', stamp(9 + index), image(stamp(number), picture(1)))
        for index, number in enumerate(order)))

    outcome = process(bag, out=tmp_path / 'out')

    assert outcome.frames == 6
    assert outcome.faults == [
        '1 frames have a stamp before that of the frame before; nobody is followed across it',
        '2 frames have the stamp of an earlier frame; report leaves their people out']


def test_a_topic_of_another_type_in_a_later_bag_is_left_out_and_named(tmp_path):
    camera = write(tmp_path / 'camera', *walk(2))
    other = write(tmp_path / 'other', ('/text', stamp(0), header(5)))

    outcome = process(camera, other, out=tmp_path / 'out')

    assert outcome.faults == [
        f'/text of bag {other} is of type std_msgs/msg/Header, not std_msgs/msg/String as in the '
        'bag before it; left out']
    with BagReader(tmp_path / 'out') as reader:
        assert reader.topics['/text'].count == 2


def test_a_bag_that_is_none_does_not_cost_the_others(tmp_path):
    camera = write(tmp_path / 'camera', *walk(2))
    (tmp_path / 'none.mcap').write_bytes(b'SQLite format 3\0')

    outcome = process(tmp_path / 'none.mcap', camera, out=tmp_path / 'out')

    assert outcome.frames == 2
    assert 'none.mcap does not begin like an .mcap file' in outcome.faults[0]
    with pytest.raises(DepthPersonError, match='does not begin like'):
        InputBags([tmp_path / 'none.mcap'])


@pytest.mark.parametrize(('first', 'second', 'fault'), [
    ('camera', 'camera', 'is given twice'), ('camera', 'camera/camera.mcap', 'is given twice'),
    ('camera/../camera', 'camera', 'is given twice'),
    ('camera/camera.mcap', 'camera', 'is left out: a part of it is given, too')])
def test_a_bag_that_is_given_twice_is_read_once(tmp_path, first, second, fault):
    write(tmp_path / 'camera', *walk(2))

    outcome = process(tmp_path / first, tmp_path / second, out=tmp_path / 'out')

    assert outcome.frames == 2
    assert [fault in each for each in outcome.faults] == [True]


def make_bag(path, plugin, mode, records):
    """Write a bag with rosbags itself, in every kind that it knows."""
    types = jazzy_types()
    writer = Writer(path, version=9, storage_plugin=plugin)
    if mode != CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, time_ns, message in records:
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, message.__msgtype__, typestore=types)
            writer.write(
                connections[topic], time_ns, types.serialize_cdr(message, message.__msgtype__))


KINDS = [
    (StoragePlugin.MCAP, CompressionMode.NONE), (StoragePlugin.MCAP, CompressionMode.STORAGE),
    (StoragePlugin.MCAP, CompressionMode.FILE), (StoragePlugin.MCAP, CompressionMode.MESSAGE),
    (StoragePlugin.SQLITE3, CompressionMode.NONE), (StoragePlugin.SQLITE3, CompressionMode.FILE),
    (StoragePlugin.SQLITE3, CompressionMode.MESSAGE)]


@pytest.mark.parametrize('metadata', [True, False])
@pytest.mark.parametrize(('plugin', 'mode'), KINDS)
def test_every_kind_of_bag_gives_the_same_with_and_without_its_metadata(
        tmp_path, plugin, mode, metadata):
    make_bag(tmp_path / 'in', plugin, mode, walk())
    if not metadata:
        (tmp_path / 'in/metadata.yaml').unlink()

    outcome = process(tmp_path / 'in', out=tmp_path / 'out')

    assert outcome.faults == []
    assert [words[2] for words in seen_in(tmp_path / 'out')] == ['0', '10', '20', '30']
    plain = write(tmp_path / 'plain', *walk())
    assert [each for each in messages_of(tmp_path / 'out') if each[0] != '/seen'] == \
        messages_of(plain)


@pytest.mark.parametrize(('plugin', 'mode'), KINDS)
def test_wherever_a_bag_is_cut_its_beginning_is_processed_or_it_is_refused(
        tmp_path, plugin, mode):
    make_bag(tmp_path / 'whole', plugin, mode, noisy_walk(12))
    whole = next(path for path in (tmp_path / 'whole').iterdir() if path.suffix != '.yaml')
    data = whole.read_bytes()
    done = []
    for cut in range(10):
        torn = tmp_path / f'torn{cut}'
        torn.mkdir()
        (torn / whole.name).write_bytes(data[:len(data) * cut // 10 + cut % 3])
        try:
            outcome = process(torn, out=tmp_path / f'out{cut}')
        except (DepthPersonError, KeyError):  # nothing can be read, or no image topic
            done.append(0)
            continue
        assert any('cut off or damaged' in fault for fault in outcome.faults)
        grey = [words[2] for words in seen_in(tmp_path / f'out{cut}')]
        assert grey == [str(10 * index + 10) for index in range(len(grey))]
        done.append(len(grey))
    assert done == sorted(done)
    assert done[-1] >= 8


def test_a_ros_1_bag_is_read_as_if_recorded_by_ros_2(tmp_path):
    types = get_typestore(Stores.ROS1_NOETIC)
    make = types.types

    def head(index):
        stamped = make['builtin_interfaces/msg/Time'](sec=1000, nanosec=index * 100_000_000)
        return make['std_msgs/msg/Header'](seq=index, stamp=stamped, frame_id='ros1_frame')

    info = make['sensor_msgs/msg/CameraInfo'](
        header=head(0), height=48, width=64, distortion_model='plumb_bob', D=np.zeros(5),
        K=np.array(K), R=np.eye(3).ravel(), P=np.eye(3, 4).ravel(), binning_x=0, binning_y=0,
        roi=make['sensor_msgs/msg/RegionOfInterest'](
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False))
    with Ros1Writer(tmp_path / 'old.bag') as writer:
        topics = {
            name: writer.add_connection(name, msgtype, typestore=types) for name, msgtype in (
                ('/camera_info', 'sensor_msgs/msg/CameraInfo'),
                ('/image', 'sensor_msgs/msg/Image'))}
        writer.write(topics['/camera_info'], stamp(0),
                     types.serialize_ros1(info, 'sensor_msgs/msg/CameraInfo'))
        for index in range(3):
            message = make['sensor_msgs/msg/Image'](
                header=head(index), height=48, width=64, encoding='bgr8', is_bigendian=0,
                step=192, data=picture(10 * index).ravel())
            writer.write(topics['/image'], stamp(index) + 1,
                         types.serialize_ros1(message, 'sensor_msgs/msg/Image'))

    outcome = process(tmp_path / 'old.bag', out=tmp_path / 'out')

    assert outcome.faults == []
    assert seen_in(tmp_path / 'out') == [
        [str(stamp(index)), 'ros1_frame', str(10 * index), 'calibrated'] for index in range(3)]
    with BagReader(tmp_path / 'out') as reader:
        (_, _, copied), = reader.messages(['/camera_info'])
        assert copied.k.tolist() == list(K)


def test_jpeg_images_are_looked_at_as_well(tmp_path):
    bag = write(tmp_path / 'in', *(
        ('/image', stamp(index), compressed(stamp(index), picture(40 * index)))
        for index in range(3)))

    process(bag, out=tmp_path / 'out')

    assert [words[2] for words in seen_in(tmp_path / 'out')] == ['0', '40', '80']
