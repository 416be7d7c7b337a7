import numpy as np
import pytest

from depth_person.distance.body_table import read_body_table
from depth_person.errors import DepthPersonError

HEADER = 'real_height_cm,d1_height_px,d3_center_x_px,person'
GOOD = ['170,1900,-12.5,ann', '180,2000,0,bob', '165,1500,9,ann']


def table(tmp_path, *lines):
    path = tmp_path / 'table.csv'
    path.write_text('\n'.join(lines) + '\n', encoding='utf-8')
    return path


def read(path, **options):
    given = {'required': ('real_height_cm', 'd1_height_px'), 'optional': ('d3_center_x_px',),
             'least_rows': 3}
    return read_body_table(path, **{**given, **options})


def test_a_table_is_read_by_the_names_of_its_columns(tmp_path):
    read_back = read(table(tmp_path, HEADER, GOOD[0], '', *GOOD[1:]))
    assert read_back['real_height_cm'].tolist() == [170, 180, 165]
    assert read_back['d3_center_x_px'].tolist() == [-12.5, 0, 9]
    assert read_back.person == ('ann', 'bob', 'ann')
    assert len(read_back) == 3
    assert 'd2_width_px' not in read_back


def test_cells_of_optional_columns_may_be_empty(tmp_path):
    path = table(tmp_path, HEADER, *GOOD[:2], '165,1500,,ann')
    assert np.isnan(read(path)['d3_center_x_px'][2])


def test_a_byte_order_mark_is_no_part_of_a_name(tmp_path):
    path = tmp_path / 'table.csv'
    path.write_bytes(b'\xef\xbb\xbf' + '\r\n'.join([HEADER, *GOOD]).encode())
    assert len(read(path)) == 3


@pytest.mark.parametrize(('lines', 'message'), [
    (('real_height_cm,d2', '1,2'), r'no column d1_height_px; it needs real_height_cm, d1_height'),
    ((HEADER, *GOOD, '170,tall,1,eve'), r"row 4, column d1_height_px: 'tall' is not a number"),
    ((HEADER, *GOOD, '170,,1,eve'), r"row 4, column d1_height_px: '' is not a number"),
    ((HEADER, '170,-3,1,eve', *GOOD), r'row 1, column d1_height_px: -3 is not positive'),
    ((HEADER, *GOOD, '0,300,1,eve'), r'row 4, column real_height_cm: 0 is not positive'),
    ((HEADER, *GOOD, 'nan,300,1,eve'), r'row 4, column real_height_cm: nan is not a finite'),
    ((HEADER, *GOOD, '170,inf,1,eve'), r'row 4, column d1_height_px: inf is not a finite'),
    ((HEADER, *GOOD, '170, 1900,-12.5 ,ann'), r'row 4 repeats row 1 in every column'),
    ((HEADER, *GOOD, '170,1900'), r'row 4 has 2 cells for 4 columns'),
    ((HEADER, *GOOD[:2]), r'2 rows are too few; 3 are needed'),
    ((HEADER,), r'0 rows are too few'),
    (('a,a', '1,2'), r'two columns are named a'),
    (('',), r'empty; its first line has to name the columns'),
])
def test_a_bad_table_gets_one_error_with_row_and_column(tmp_path, lines, message):
    with pytest.raises(DepthPersonError, match=rf'table\.csv: {message}'):
        read(table(tmp_path, *lines))


def test_one_single_height_is_refused(tmp_path):
    same = read(table(tmp_path, HEADER, '170,1,1,a', '170,2,2,b', '170,3,3,c'))
    with pytest.raises(DepthPersonError, match='real_height_cm is 170 in all 3 rows; nothing'):
        same.must_vary('real_height_cm', 'nothing to learn')
    same.must_vary('d1_height_px', 'nothing to learn')


def test_a_missing_or_binary_file_is_refused(tmp_path):
    with pytest.raises(DepthPersonError, match='No such file'):
        read(tmp_path / 'none.csv')
    (tmp_path / 'image.png').write_bytes(b'\x89PNG\xff\xfe\x00')
    with pytest.raises(DepthPersonError, match='not a CSV file in UTF-8'):
        read(tmp_path / 'image.png')
