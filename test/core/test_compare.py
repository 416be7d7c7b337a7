"""What compare takes for the same and what for different."""
from dataclasses import replace
import json
import math
from pathlib import Path
import re
import sys

from bag_messages import string
import numpy as np
import pytest
from result_bags import cloud, people, results, START_NS, STEP_NS, TOPIC, write_results

from depth_person.cli import main
from depth_person.errors import DepthPersonError
from depth_person.replay.bags import BagWriter
from depth_person.replay.compare import compare, Tolerances
from depth_person.replay.golden import read_golden, write_golden
from depth_person.replay.results import read_results

NOBODY = (math.nan, math.nan, math.nan, math.nan)


def walk(step, *, scale=1.0, sigma=0.2, ids=(1, 2), shift=0.0):
    """Return a frame in which one comes nearer and another goes across, who meet at step 5."""
    near, across = (0.1, 0.2, 6.0 - 0.2 * step), (-1.0 + 0.22 * step, 0.0, 5.5)
    return [(scale * x + shift, scale * y, scale * z, sigma, name)
            for (x, y, z), name in zip((near, across), ids, strict=True)]


def walked(**change):
    """Return the results of ten frames of walk()."""
    return results([walk(step, **change) for step in range(10)])


@pytest.fixture
def bags(tmp_path):
    """Return the paths of a bag of walked() and of one in which all are 10 % further away."""
    return [
        str(write_results(tmp_path / name, [walk(step, scale=scale) for step in range(10)]))
        for name, scale in (('a', 1.0), ('b', 1.1))]


def test_results_are_the_same_as_themselves():
    same = compare(walked(), walked(), Tolerances(0, 0, 0, 0), ids='same')
    assert same.agree
    assert len(same.range_change) == 20
    assert same.lone_frames == (0, 0)


@pytest.mark.parametrize(('change', 'tolerances', 'agree'), [
    ({'scale': 1.02}, Tolerances(), True),
    ({'scale': 1.04}, Tolerances(), False),
    ({'scale': 1.04}, Tolerances(range=0.05), True),
    ({'scale': 0.96}, Tolerances(), False),
    ({'shift': 0.1}, Tolerances(), True),
    ({'shift': 0.4}, Tolerances(range=1.0), False),
    ({'shift': 0.4}, Tolerances(range=1.0, position=0.2), True),
    ({'sigma': 0.25}, Tolerances(), True),
    ({'sigma': 0.28}, Tolerances(), False),
    ({'sigma': 0.12}, Tolerances(), False),
    ({'sigma': 0.12}, Tolerances(sigma=0.5), True),
])
def test_what_moves_by_more_than_its_tolerance_is_different(change, tolerances, agree):
    assert compare(walked(), walked(**change), tolerances).agree is agree


@pytest.mark.parametrize(('ids', 'agree'), [('renamed', True), ('same', False), ('any', True)])
def test_other_numbers_for_the_same_people(ids, agree):
    result = compare(walked(), walked(ids=(7, 1)), ids=ids)
    assert result.agree is agree
    assert result.pairs.renaming == {1: 7, 2: 1}


@pytest.mark.parametrize(('ids', 'moved'), [('renamed', 8), ('same', 8), ('any', 0)])
def test_people_who_exchange_their_numbers_are_noticed(ids, moved):
    frames = [walk(step, ids=(1, 2) if step < 6 else (2, 1)) for step in range(10)]
    result = compare(walked(), results(frames), ids=ids)
    assert result.id_moved.sum() == moved
    assert result.agree is (moved == 0)


@pytest.mark.parametrize(('allow', 'agree'), [(0.0, False), (0.04, False), (0.06, True)])
def test_a_person_who_is_missing_once_is_tolerated_where_allowed(allow, agree):
    frames = [walk(step)[:1 if step == 3 else 2] for step in range(10)]
    fewer = results(frames)
    for a, b in ((walked(), fewer), (fewer, walked())):
        result = compare(a, b, Tolerances(allow=allow))
        assert result.missing.sum() == 1
        assert result.agree is agree


def test_a_frame_that_only_one_has_is_missing_even_without_people():
    a, b = results([[], [], []]), results([[], []])
    assert compare(a, a).agree
    assert compare(a, b).lone_frames == (1, 0)
    assert not compare(a, b).agree
    assert compare(a, b, Tolerances(allow=0.34)).agree


def test_stamps_that_never_meet_are_different_whatever_is_allowed():
    moved = replace(walked(), stamps_ns=walked().stamps_ns + STEP_NS // 2)
    assert not compare(walked(), moved, Tolerances(allow=1.0)).agree


def test_a_range_that_is_lost_is_different_and_one_that_neither_has_is_not():
    frames = [[walk(step)[0], (*NOBODY, 2)] for step in range(10)]
    lost = results(frames)
    result = compare(walked(), lost)
    assert result.lost.sum() == 10
    assert not result.agree
    assert compare(lost, lost).agree


@pytest.mark.parametrize('field', ['range_sigma', 'position'])
def test_a_sigma_or_a_place_that_is_lost_is_different(field):
    lost = replace(walked(), people=replace(
        walked().people, **{field: getattr(walked().people, field) * np.nan}))
    assert compare(walked(), lost).beyond.all()
    assert compare(lost, walked()).beyond.all()
    assert compare(lost, lost).agree


@pytest.mark.parametrize('wrong', [-3.0, 0.0])
def test_a_range_that_can_be_none_is_named_and_taken_for_none(tmp_path, capsys, wrong):
    points = people(*walk(0))
    points['range'][0] = wrong
    path = tmp_path / 'a'
    with BagWriter(path) as bag:
        bag.write(TOPIC, START_NS, cloud(START_NS, points))
    found = read_results(path)
    assert np.isnan(found.people.range).tolist() == [True] + [False] * (len(points) - 1)
    assert main(['compare', str(path), str(path)]) == 2
    said = capsys.readouterr()
    assert '1 messages with a range that is not positive' in said.err
    assert 'the same' in said.out


def test_golden_values_are_the_results_they_were_written_from(tmp_path):
    path = tmp_path / 'golden.json'
    write_golden(path, walked(), Tolerances(range=0.01, allow=0.1))
    again, tolerances = read_golden(path)
    assert tolerances == Tolerances(range=0.01, allow=0.1)
    assert compare(again, walked(), Tolerances(1e-4, 1e-4, 1e-3), ids='same').agree


@pytest.mark.parametrize(('text', 'message'), [
    ('{', 'is not valid JSON'),
    ('[]', 'is not a JSON object'),
    ('{"frames": []}', 'frames is empty'),
    ('{"frames": [{"stamp_ns": "1", "people": []}]}', r'frames\[0\]: stamp_ns is'),
    ('{"frames": [{"stamp_ns": 1, "people": [{"id": 1, "range": -2}]}]}', 'position is missing'),
    ('{"frames": [{"stamp_ns": 1, "people": []}], "tolerances": {"range": -1}}', 'tolerance'),
    (f'{{"frames": [{{"stamp_ns": {10**20}, "people": []}}]}}', 'more than 64 bits'),
    (f'{{"frames": [{{"stamp_ns": 1, "people": [{{"id": {10**20}}}]}}]}}', 'more than 64 bits'),
    (f'{{"frames": [], "tolerances": {{"range": {10**400}}}}}', 'range is inf'),
    (10**5 * '[', 'is not valid JSON'),
])
def test_golden_values_that_are_none_are_refused(tmp_path, text, message):
    path = tmp_path / 'golden.json'
    path.write_text(text)
    with pytest.raises(DepthPersonError, match=message) as caught:
        read_golden(path)
    assert str(path) in str(caught.value)


def test_the_command_prints_who_moved_and_tells_by_its_exit_code(tmp_path, bags, capsys):
    a, b = bags
    assert main(['compare', a, a]) == 0
    assert 'the same: 0 of 20' in capsys.readouterr().out
    plots = tmp_path / 'plots'
    assert main(['compare', a, b, '--lines', '3', '--plots', str(plots)]) == 1
    said = capsys.readouterr().out
    assert re.search(r'#1 +#1 +10 +0 +0 +10\.00 +10\.00 +10\.00 +10\.00 +0\.00', said)
    assert len(re.findall(r'range .* -> .* m \(\+10\.00 %\)', said)) == 3
    assert 'different: 20 of 20' in said
    assert {file.name for file in plots.iterdir()} == {'ranges.png', 'changes.png'}
    assert main(['compare', a, b, '--range', '0.2', '--position', '0.2']) == 0


def test_a_missing_matplotlib_is_said_before_the_work(tmp_path, bags, monkeypatch, capsys):
    for module in ('drawing', 'compare_plots'):
        monkeypatch.delitem(sys.modules, f'depth_person.replay.{module}', raising=False)
    monkeypatch.setitem(sys.modules, 'matplotlib.figure', None)
    assert main(['compare', *bags, '--plots', str(tmp_path / 'plots')]) == 2
    captured = capsys.readouterr()
    assert 'pip install "depth_person[demo]"' in captured.err
    assert captured.out == ''


def test_golden_values_bring_their_tolerances_which_options_override(tmp_path, bags):
    golden = tmp_path / 'golden.json'
    write_golden(golden, walked(), Tolerances(range=0.2, position=0.2))
    assert main(['compare', str(golden), bags[1]]) == 0
    assert main(['compare', str(golden), bags[1], '--range', '0.05']) == 1


def damaged(folder, kind):
    """Return a bag with something wrong."""
    path = folder / kind
    good = [walk(step) for step in range(10)]
    if kind == 'text':
        path.write_text('no bag')
    elif kind == 'other':
        with BagWriter(path) as bag:
            bag.write(TOPIC, 0, string('not a cloud'))
    elif kind == 'empty':
        path.mkdir()
    elif kind in ('zero', 'twice', 'back'):
        odd = {'zero': 0, 'twice': START_NS + 3 * STEP_NS, 'back': START_NS + 2 * STEP_NS + 1}
        write_results(path, good, stamps_ns=[
            odd[kind] if step == 4 else START_NS + step * STEP_NS for step in range(10)])
    elif kind == 'magic':
        write_results(path, good)
        (path / 'magic.mcap').write_bytes(b'PNG' + (path / 'magic.mcap').read_bytes()[3:])
    elif kind == 'undecodable':
        with BagWriter(path) as bag:
            for step, rows in enumerate(good):
                bag.write(TOPIC, step, cloud(START_NS + step * STEP_NS, people(*rows)))
            bag.write_raw(TOPIC, 20, b'\0\1\0\0 no cloud')
    elif kind == 'torn':
        write_results(path, good)
        data = (path / 'torn.mcap').read_bytes()
        (path / 'torn.mcap').write_bytes(data[:len(data) // 2])
    return path


@pytest.mark.parametrize(('kind', 'said'), [
    ('nothing', 'there is no bag at'), ('text', 'no rosbag'), ('empty', 'no rosbag'),
    ('other', 'holds no results'), ('zero', '1 messages without a stamp, left out'),
    ('twice', '1 messages whose stamp came before, left out'),
    ('back', '1 messages whose stamp lies before the one ahead of it'),
    ('torn', 'is damaged'), ('magic', 'does not begin like an .mcap file'),
    ('undecodable', '1 messages that cannot be decoded, left out'),
])
def test_bad_input_is_named_and_its_exit_code_is_2(tmp_path, bags, capsys, kind, said):
    assert main(['compare', bags[0], str(damaged(tmp_path, kind))]) == 2
    assert said in capsys.readouterr().err


def test_a_bag_without_its_metadata_is_compared_all_the_same(bags, capsys):
    (Path(bags[1]) / 'metadata.yaml').unlink()
    assert main(['compare', *bags]) == 1
    assert '10 frames in both' in capsys.readouterr().out


def test_a_cloud_without_what_results_hold_is_left_out_and_counted(tmp_path, capsys):
    path = write_results(tmp_path / 'a', [walk(0), walk(1)])
    text = (path / 'a.mcap').read_bytes()
    assert text.count(b'range_sigma') == 2
    at = text.index(b'range_sigma')
    (path / 'a.mcap').write_bytes(text[:at] + b'range_sugar' + text[at + 11:])
    assert main(['compare', str(path), str(path)]) == 2
    said = capsys.readouterr()
    assert '1 messages left out: the cloud lacks range_sigma' in said.err
    assert '1 frames in both' in said.out


@pytest.mark.parametrize('option', [['--range', '-1'], ['--sigma', 'nan'], ['--ids', 'maybe']])
def test_options_that_mean_nothing_are_refused(option):
    with pytest.raises(SystemExit) as caught:
        main(['compare', 'a', 'b', *option])
    assert caught.value.code == 2


def test_the_topic_of_a_namespace_is_found_and_of_two_one_must_be_chosen(tmp_path):
    frames = [walk(0)]
    assert len(read_results(write_results(
        tmp_path / 'a', frames, topic='/front/person_depth/people')).people) == 2
    with BagWriter(tmp_path / 'b') as bag:
        for topic in ('/front' + TOPIC, '/rear' + TOPIC):
            bag.add_topic(topic, 'sensor_msgs/msg/PointCloud2')
    with pytest.raises(DepthPersonError, match=r'choose by --topic: /front.*/rear'):
        read_results(tmp_path / 'b')


def test_golden_files_are_text_of_one_person_a_line(tmp_path):
    path = tmp_path / 'golden.json'
    write_golden(path, walked(), Tolerances())
    people = [line for line in path.read_text().splitlines() if '"id"' in line]
    assert len(people) == 20
    first = json.loads(path.read_text())['frames'][0]
    assert first['stamp_ns'] == START_NS
    assert first['people'][0]['position'] == pytest.approx([0.1, 0.2, 6.0])
    assert first['people'][0]['range'] == pytest.approx(np.linalg.norm([0.1, 0.2, 6.0]), abs=1e-4)
