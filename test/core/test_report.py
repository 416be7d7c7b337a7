"""The page about a bag of results: complete, self-contained, and right."""
import base64
from html.parser import HTMLParser
import re
import xml.etree.ElementTree as ET

from bag_messages import compressed, picture
import cv2
import numpy as np
import pytest
from report_bag import FRAMES, HEIGHT, true_place, WIDTH, write_report_bag
from result_bags import cloud, people, START_NS, STEP_NS, TOPIC, write_results
from result_bags import results as made_results

from depth_person.cli import main
from depth_person.errors import DepthPersonError
from depth_person.replay import drawing, report, report_plots
from depth_person.replay.bags import BagWriter
from depth_person.replay.report import make_report
from depth_person.replay.results import read_results
from depth_person.replay.timing import timing
from depth_person.replay.truth import read_truth
from depth_person.replay.unfinished import RunRecord

VOID = {'meta', 'img', 'br'}


class Page(HTMLParser):
    """A parsed page: that its tags are closed is checked on the way."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes, self.rows, self.words = [], [], [], ''
        self._open = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += attributes
        if tag == 'tr':
            self.rows.append([])
        if tag in ('td', 'th'):
            self.rows[-1].append('')
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.words += data
        if self._open and self._open[-1] in ('td', 'th'):
            self.rows[-1][-1] += data

    def named(self, name):
        return [value for key, value in self.attributes if key == name]

    def row(self, first):
        """Return the cells of the row that begins so, by the heading above it."""
        heading = None
        for row in self.rows:
            if row[0] in ('people', 'person', 'topic'):
                heading = row
            if row[0] == first:
                return dict(zip(heading or row, row, strict=False))
        raise AssertionError(f'no row {first}')


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a bag in which everyone is measured 10 % too far, with a sigma of 0.3 m."""
    return write_report_bag(tmp_path_factory.mktemp('bag') / 'walk')


@pytest.fixture(scope='module')
def html(bag):
    return make_report(bag, truth='/person_truth').html


@pytest.fixture(scope='module')
def page(html):
    return Page(html)


def test_the_page_needs_nothing_beside_it(html, page):
    assert page.tags.count('script') == 0
    assert not {'link', 'iframe', 'object', 'embed', 'base', 'svg'} & set(page.tags)
    assert [name for name, _ in page.attributes if name.startswith('on')] == []
    assert page.named('href') == []
    sources = page.named('src')
    assert len(sources) == 4 + 6
    assert all(source.startswith('data:image/') for source in sources)
    assert 'http://' not in html
    assert 'https://' not in html
    assert 'url(' not in html
    assert "default-src 'none'; img-src data:" in html


def test_every_name_is_there_once(page):
    ids = page.named('id')
    assert sorted(ids) == sorted(set(ids))
    assert {'people', 'topics', 'range-over-time', 'birds-eye-view', 'errors', 'timing',
            'frames'} <= set(ids)
    assert all(page.named('alt'))


def test_the_drawings_are_whole_and_need_nothing_either(page):
    drawings = [base64.b64decode(source.partition(',')[2]) for source in page.named('src')
                if source.startswith('data:image/svg')]
    assert len(drawings) == 4
    for data in drawings:
        root = ET.fromstring(data)
        assert root.tag.endswith('svg')
        links = [value for each in root.iter() for key, value in each.attrib.items()
                 if key.endswith(('href', 'src'))]
        assert all(link.startswith('#') for link in links)
        ids = {each.get('id') for each in root.iter() if each.get('id')}
        assert {link[1:] for link in links} <= ids


def test_sample_frames_show_the_skeleton_in_the_picture(page):
    pictures = [
        cv2.imdecode(np.frombuffer(base64.b64decode(source.partition(',')[2]), np.uint8), 1)
        for source in page.named('src') if source.startswith('data:image/jpeg')]
    assert len(pictures) == 6
    for shown in pictures:
        assert shown.shape == (HEIGHT, WIDTH, 3)
        corner, middle = shown[-50:, :50].std(), shown[60:, 280:420].std()
        assert corner < 2 < middle


def test_the_errors_are_those_of_the_bag(page):
    everyone = page.row('all')
    assert everyone['n'] == str(FRAMES)
    assert everyone['found'] == '100%'
    assert everyone['median error'] == '10.0%'
    true = np.linalg.norm([true_place(index) for index in range(FRAMES)], axis=1)
    assert float(everyone['bias m']) == pytest.approx(0.1 * true.mean(), abs=0.006)
    assert everyone['within 1 sigma'] == '0%'
    assert everyone['within 2 sigma'] == f'{(0.1 * true <= 0.6).mean():.0%}'
    assert page.row('true person 5, #1')['n'] == str(FRAMES)
    assert page.row('5-10 m')['n'] == str((true >= 5).sum())
    assert 'Ranges that belong to nobody known: 0' in page.words


def test_the_people_and_the_topics_are_listed(page):
    person = page.row('#1')
    assert person['frames'] == str(FRAMES)
    assert person['nearest m'] == f'{1.1 * np.linalg.norm(true_place(0)):.2f}'
    assert page.row('/image_raw/compressed')['messages'] == str(FRAMES)
    assert f'0 of {FRAMES} images have no result' in page.words


def test_when_and_how_the_results_were_made_is_told(tmp_path):
    bag = write_report_bag(tmp_path / 'bag', images=False)
    assert 'The first frame is of 2023-11-14 22:13:20 UTC.' in Page(make_report(bag).html).words
    RunRecord({
        'version': '1.2', 'pose_node': {'model': 'net'}, 'depth_node': {'estimator': 'shoulder'}},
        finished=False, faults=['5 frames are <uncalibrated>']).write(bag)
    made = make_report(bag)
    words = Page(made.html).words
    assert 'process 1.2, network net, estimator shoulder.' in words
    assert 'stopped before the end' in words
    assert 'What process could not use5 frames are <uncalibrated>' in words
    assert not made.faults


@pytest.mark.parametrize('text', [
    '{"settings": []}', '{"settings": {"version": "1", "pose_node": 3}}', '[]', '{"settings": 1}',
    '{"settings": {"version": "1", "pose_node": {"model": "a"}, "depth_node": {"estimator": "b"}},'
    ' "faults": 7}'])
def test_a_record_of_the_run_that_is_none_does_no_harm(tmp_path, text):
    bag = write_results(tmp_path / 'bag', [[]])
    (bag / 'process.json').write_text(text)
    assert 'The first frame is of' in Page(make_report(bag).html).words


def test_a_clock_without_a_date_is_told_none(tmp_path):
    bag = write_results(tmp_path / 'bag', [[]], stamps_ns=[12_500_000_000])
    assert 'stamp 12.500 s, of a clock without a date' in Page(make_report(bag).html).words


def test_of_very_many_people_some_are_listed_and_all_are_drawn(tmp_path):
    places = [(0.1, 0.0, 5.0 + 0.01 * step, 0.3, step // 2) for step in range(301)]
    bag = write_results(tmp_path / 'bag', [[place] for place in places])
    page = Page(make_report(bag).html)
    assert sum(row[0].startswith('#') for row in page.rows) == report.MOST_LISTED
    assert '101 more were there in at most 2 frames' in page.words
    figure = report_plots.ranges_figure(read_results(bag), None)
    axes, = figure.axes
    assert len(axes.get_legend().get_texts()) == drawing.MOST_NAMES + 1
    assert len(axes.lines) < 100
    drawn = np.concatenate([line.get_ydata() for line in axes.lines if line.get_lw() == 1.6])
    assert np.sort(drawn[np.isfinite(drawn)]) == pytest.approx(
        np.sort(read_results(bag).people.range))


def test_lines_end_between_the_tracks_of_one_colour():
    found = dict(drawing.strands(np.array([1, 7, 1, 0]), np.array([3.0, 1.0, 2.0, 0.0])))
    assert found[drawing.rgb(1)].tolist() == [2, 0, -1, 1, -1]
    assert found[drawing.rgb(0)].tolist() == [3, -1]
    assert np.isnan(drawing.at_rows(np.array([5]), np.array([0, -1]))).tolist() == [False, True]


@pytest.mark.parametrize('track', range(16))
def test_every_colour_shows_on_white(track):
    assert np.dot(drawing.rgb(track), (0.3, 0.59, 0.11)) <= 0.6 + 1e-9


def test_of_several_cameras_the_one_beside_the_results_gives_the_sample_frames(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        bag.write('/front/person_depth/people', START_NS, cloud(START_NS, people((0, 0, 4, 1, 1))))
        for place, grey in (('front', 200), ('rear', 20)):
            bag.write(f'/{place}/image_raw/compressed', START_NS, compressed(
                START_NS, picture(grey)))
        bag.write('/front/person_depth/image/compressed', START_NS, compressed(
            START_NS, picture(90)))
    shown = [source for source in Page(make_report(tmp_path / 'bag').html).named('src')
             if source.startswith('data:image/jpeg')]
    assert len(shown) == 1
    data = np.frombuffer(base64.b64decode(shown[0].partition(',')[2]), np.uint8)
    assert np.median(cv2.imdecode(data, 1)) == pytest.approx(200, abs=2)


def test_an_image_without_a_stamp_is_found_by_its_time_of_recording(tmp_path):
    with BagWriter(tmp_path / 'bag') as bag:
        bag.write('/image_raw/compressed', START_NS, compressed(0, picture(200)))
        bag.write(TOPIC, START_NS, cloud(START_NS, people((0, 0, 4, 1, 1))))
    page = Page(make_report(tmp_path / 'bag').html)
    assert '0 of 1 images have no result' in page.words
    assert len([each for each in page.named('src') if each.startswith('data:image/jpeg')]) == 1


def test_drawings_of_very_many_points_are_in_pixels(bag, monkeypatch):
    monkeypatch.setattr(drawing, 'MOST_POINTS', FRAMES - 1)
    sources = Page(make_report(bag, frames=0).html).named('src')
    assert [source.partition(';')[0] for source in sources] == 3 * ['data:image/png']


def test_the_same_bag_gives_the_same_page(bag, html):
    assert make_report(bag, truth='/person_truth').html == html


def test_a_name_that_looks_like_html_stays_text(tmp_path):
    bag = write_report_bag(tmp_path / '<b>&amp;', images=False)
    assert 'People in <b>&amp;' in Page(make_report(bag).html).words


def test_a_bag_without_images_or_people_gives_a_page_that_says_so(tmp_path):
    page = Page(make_report(write_results(tmp_path / 'bag', [[], []])).html)
    assert 'None: bag' in page.words
    assert 'no topic of type sensor_msgs/msg/Image' in page.words
    assert '0 people in 0 sightings' in page.words


@pytest.mark.parametrize(('delay_ns', 'latency'), [
    (0, None), (50_000_000, [50.0] * FRAMES), (-50_000_000, None), (10**13, None)])
def test_latency_is_told_only_where_stamps_and_recording_share_a_clock(
        tmp_path, delay_ns, latency):
    found = timing(read_results(write_report_bag(
        tmp_path / 'bag', delay_ns=delay_ns, images=False)))
    if latency is None:
        assert found.latency_s is None
        assert found.remark
    else:
        assert 1e3 * found.latency_s == pytest.approx(latency, abs=1e-3)
        assert not found.remark


@pytest.mark.parametrize(('later_ns', 'record', 'known'), [
    (0, False, False), (1, False, True), (1, True, False)])
def test_results_of_process_have_no_latency_although_their_images_were_recorded_late(
        tmp_path, later_ns, record, known):
    """A flight's images reach the recorder after their stamps, and process keeps that time."""
    with BagWriter(tmp_path / 'bag') as bag:
        for stamp in range(START_NS, START_NS + 5 * STEP_NS, STEP_NS):
            arrived = stamp + 40_000_000
            bag.write('/image_raw/compressed', arrived, compressed(stamp, picture(9)))
            bag.write(TOPIC, arrived + later_ns, cloud(stamp, people((0, 0, 4, 1, 1))))
    if record:
        RunRecord({}).write(tmp_path / 'bag')
    words = Page(make_report(tmp_path / 'bag').html).words
    assert ('latency from stamp to recording, median40 ms' in words) == known
    assert ('made offline' in words) != known


def test_gaps_are_counted():
    whole = made_results([[]] * 6)
    assert timing(whole).gaps == 0
    keep = [0, 1, 2, 4, 5]
    torn = type(whole)('', whole.stamps_ns[keep], whole.recorded_ns[keep], whole.people)
    assert timing(torn).gaps == 1
    assert timing(torn).interval_s.max() == pytest.approx(0.2)


TABLES = {
    'places by nanoseconds': 'stamp_ns,id,x,y,z\n'
    f'{START_NS},7,1,2,2\n{START_NS + 4 * STEP_NS},7,2,4,4\n',
    'ranges by seconds': f'stamp_s,range\n{START_NS / 1e9},3\n{START_NS / 1e9 + 0.4},6\n',
    'ranges after the first': 'time_s,range,id\n0,3,1\n0.4,6,1\n',
}


@pytest.mark.parametrize('kind', TABLES)
def test_truth_between_two_rows_of_a_table_is_interpolated(tmp_path, kind):
    path = tmp_path / 'truth.csv'
    path.write_text(TABLES[kind])
    truth = read_truth(str(path), made_results([[]] * 8), tmp_path)
    assert truth.people.frame.tolist() == [0, 1, 2, 3, 4]
    assert truth.people.range == pytest.approx([3, 3.75, 4.5, 5.25, 6])


def test_truth_across_a_long_gap_is_not_known(tmp_path):
    path = tmp_path / 'truth.csv'
    path.write_text('time_s,range\n0,3\n0.7,6\n')
    truth = read_truth(str(path), made_results([[]] * 8), tmp_path)
    assert truth.people.frame.tolist() == [0, 7]


@pytest.mark.parametrize(('text', 'said'), [
    ('', 'has 0 rows of nothing'), ('a,b\n1,2\n', 'has 1 rows of a, b'),
    ('stamp_ns,range\n1,far\n', 'no table of numbers'),
    ('stamp_ns,range\n1.5,2\n', 'no table of numbers'),
    ('time_s,range\nnan,2\n', 'no table of numbers'),
    ('time_s,range\n1,-2\n', 'a range that is no positive number'),
    ('time_s,x,y\n1,2,3\n', 'it needs one of .* and range or x, y, z'),
    ('time_s,range\n0,\n', 'tells the range, or x, y and z, of nobody'),
    ('time_s,range\n0,3\n0.1,"4,2"\n', "line 3 has time_s '0.1', range '4,2'"),
    ('time_s,range,id\n0,3,anna\n', "id 'anna'"),
    (f'stamp_ns,range\n{10**20},3\n', 'no table of numbers'),
    ('stamp_s,range\n1e30,3\n', 'no table of numbers'),
    (f'time_s,range,id\n0,3,{10**20}\n', 'no table of numbers'),
    ('time_s,range\n0,3\n0,5\n', 'two ranges of person 0 at .* need an id'),
    ('time_s,range\n500,3\n501,5\n', 'is of another time'),
])
def test_a_table_that_is_no_truth_is_refused(tmp_path, text, said):
    path = tmp_path / 'truth.csv'
    path.write_text(text)
    with pytest.raises(DepthPersonError, match=said):
        read_truth(str(path), made_results([[]]), tmp_path)


@pytest.mark.parametrize('text', [
    '\ufefftime_s,range\r\n0,3\r\n0.4,5\r\n', 'time_s; range; id\n0; 3; 1\n0.4; 5; 1\n',
    'range\ttime_s\n3\t0\n\n5\t0.4\n', 'id, time_s, range\n1.0, 0, 3\n1.0, 0.4, 5\n',
    'time_s,range,by\n0,3,hand\n0.4,5\n'])
def test_a_table_is_read_as_spreadsheets_and_programs_write_it(tmp_path, text):
    path = tmp_path / 'truth.csv'
    path.write_bytes(text.encode())
    truth = read_truth(str(path), made_results([[]] * 5), tmp_path)
    assert truth.people.range == pytest.approx([3, 3.5, 4, 4.5, 5])
    assert not truth.faults


def test_seconds_are_as_exact_as_nanoseconds(tmp_path):
    """So that truth of the image itself counts where its neighbours are far."""
    path = tmp_path / 'truth.csv'
    stamps = [START_NS + 1_234_567, START_NS + 10**9 + 7_654_321]
    path.write_text('stamp_s,range\n' + ''.join(
        f'{stamp // 10**9}.{stamp % 10**9:09d},4\n' for stamp in stamps))
    known = made_results([[], []])
    frames = type(known)('', np.array(stamps), known.recorded_ns, known.people)
    assert read_truth(str(path), frames, tmp_path).people.frame.tolist() == [0, 1]


def test_rows_of_a_table_without_a_range_are_left_out_and_counted(tmp_path):
    path = tmp_path / 'truth.csv'
    path.write_text('time_s,range\n0,3\n0.1,\n0.2,nan\n0.4,5\n')
    truth = read_truth(str(path), made_results([[]] * 5), tmp_path)
    assert truth.people.range == pytest.approx([3, 3.5, 4, 4.5, 5])
    assert truth.faults == (
        f'the truth {path}: 2 people without a range, or x, y and z, are left out',)


@pytest.mark.parametrize(('topic', 'said'), [
    ('/nothing', 'is not in it'), ('camera_info', 'is sensor_msgs/msg/CameraInfo')])
def test_a_topic_that_is_no_truth_is_refused(bag, topic, said):
    with pytest.raises(DepthPersonError, match=said):
        make_report(bag, truth=topic)


def test_the_command_writes_the_page(bag, tmp_path, capsys):
    out = tmp_path / 'new' / 'report.html'
    assert main(['report', str(bag), '--truth', '/person_truth', '-o', str(out),
                 '--frames', '2']) == 0
    assert Page(out.read_text()).named('src')
    assert f'wrote {out}' in capsys.readouterr().out


@pytest.mark.parametrize('out', ['bag/bag.mcap', 'bag/metadata.yaml', 'truth.csv', 'bag'])
def test_the_page_never_replaces_what_is_read(tmp_path, capsys, out):
    bag = write_report_bag(tmp_path / 'bag', images=False)
    (tmp_path / 'truth.csv').write_text('time_s,range\n0,3\n')
    before = {path: path.read_bytes() for path in tmp_path.rglob('*') if path.is_file()}
    for source in (bag, bag / 'bag.mcap'):
        assert main(['report', str(source), '--truth', str(tmp_path / 'truth.csv'), '-o',
                     str(tmp_path / out)]) == 1
    assert {path: path.read_bytes() for path in tmp_path.rglob('*') if path.is_file()} == before


@pytest.mark.parametrize('part', [0.4, 0.99])
def test_of_a_torn_bag_what_is_left_is_reported_and_the_exit_code_is_3(tmp_path, capsys, part):
    bag = write_report_bag(tmp_path / 'bag')
    data = (bag / 'bag.mcap').read_bytes()
    (bag / 'bag.mcap').write_bytes(data[:int(part * len(data))])
    out = tmp_path / 'report.html'
    assert main(['report', str(bag), '-o', str(out)]) == 3
    page = Page(out.read_text())
    assert int(re.search(r'(\d+) frames in', page.words)[1]) >= int(part * FRAMES) - 1
    assert 'What could not be used' in page.words
    assert 'is damaged' in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'said'), [
    (['/nowhere'], 'there is no bag at'),
    (['BAG', '--topic', 'image_raw/compressed'], 'is of type'),
    (['BAG', '--image-topic', '/nothing'], 'no image topic /nothing'),
    (['BAG', '-o', '/proc/nowhere/report.html'], 'cannot write'),
])
def test_what_cannot_be_is_named(bag, tmp_path, capsys, arguments, said):
    arguments = [str(bag) if word == 'BAG' else word for word in arguments]
    if '-o' not in arguments:
        arguments += ['-o', str(tmp_path / 'report.html')]
    assert main(['report', *arguments]) == 1
    assert said in capsys.readouterr().err
