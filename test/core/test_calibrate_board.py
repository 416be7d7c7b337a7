"""Boards tell the intrinsics of the camera that saw them, or that they cannot."""
import cv2
from drawn_boards import BoardCamera, chessboard_texture, poses
import numpy as np
import pytest

from depth_person.camera.board_calibration import BoardViews, calibrate
from depth_person.camera.boards import BoardView, CharucoBoard, Chessboard
from depth_person.camera.calibration import load_camera_info
from depth_person.camera.intrinsics import Intrinsics
from depth_person.cli import main
from depth_person.errors import DepthPersonError

SQUARE = 0.04
SIZE = (640, 480)
CAMERAS = {
    'plumb_bob': Intrinsics(
        *SIZE, 520.0, 516.0, 325.0, 236.0, 'plumb_bob', (-0.21, 0.06, 0.001, -0.0008, -0.005)),
    'rational_polynomial': Intrinsics(
        *SIZE, 500.0, 500.0, 318.0, 244.0, 'rational_polynomial',
        (0.15, -0.05, 0.0004, 0.0003, 0.002, 0.4, -0.05, 0.01)),
    'equidistant': Intrinsics(
        *SIZE, 300.0, 302.0, 321.0, 238.0, 'equidistant', (0.02, -0.01, 0.004, -0.001)),
}


def images(camera, n=16, *, seed=1, distance=0.5, spread=0.33):
    rng = np.random.default_rng(seed)
    texture = chessboard_texture(7, 5)
    renderer = BoardCamera(camera)
    for turn, shift in poses(rng, n, distance=distance, spread=spread):
        yield renderer.see(texture, square=SQUARE, turn=turn, shift=shift)


def exact_views(camera, n=24, *, noise=0.0, tilt=1.0, seed=1):
    """Views by projecting the corners, which is quicker than rendering and finding them."""
    rng = np.random.default_rng(seed)
    board = Chessboard(9, 6, square=SQUARE)
    corners = board._corners - board._corners.mean(axis=0)
    views = BoardViews(camera.width, camera.height)
    for turn, shift in poses(rng, n, distance=0.55, spread=0.32 * 520 / camera.fx):
        rotation, _ = cv2.Rodrigues(turn * tilt)
        places = np.column_stack([corners, np.zeros(len(corners))]) @ rotation.T + shift
        pixels = camera.project(places) + rng.normal(0, noise, (len(corners), 2))
        views.offer(BoardView(board._corners, pixels.astype(np.float32)))
    return views


def corner_error(found, true):
    """Return how far the image's corners are from where they were, by the two lenses, pixels."""
    corners = np.array([(0, 0), (true.width - 1, 0), (0, true.height - 1),
                        (true.width - 1, true.height - 1)], float)
    plane = true.undistort(corners)
    rays = np.concatenate([plane, np.ones((4, 1))], axis=1)
    ideal = Intrinsics(
        true.width, true.height, true.fx, true.fy, true.cx, true.cy,
        found.distortion_model, found.distortion)
    return np.abs(ideal.project(rays) - corners).max()


def test_a_video_of_a_rendered_board_gives_focal_length_and_distortion(tmp_path, capsys):
    camera = CAMERAS['plumb_bob']
    for i, image in enumerate(images(camera)):
        cv2.imwrite(str(tmp_path / f'{i:03}.png'), image)
    out = tmp_path / 'camera.yaml'
    code = main(['calibrate', str(tmp_path), '--chessboard', '7x5', '--square', str(SQUARE),
                 '--name', 'front', '-o', str(out)])
    assert code == 0
    name, found = load_camera_info(str(out))
    assert name == 'front'
    assert found.fx == pytest.approx(camera.fx, rel=0.005)
    assert found.fy == pytest.approx(camera.fy, rel=0.005)
    assert corner_error(found, camera) < 0.5
    said = capsys.readouterr().out
    assert 'reprojection error 0.' in said
    assert '#' in said


@pytest.mark.parametrize('model', CAMERAS)
def test_corners_with_noise_give_every_model_back(model):
    camera = CAMERAS[model]
    result = calibrate(exact_views(camera, 36, noise=0.1), model=model)
    assert result.intrinsics.distortion_model == model
    assert result.intrinsics.fx == pytest.approx(camera.fx, rel=0.005)
    assert result.reprojection_error == pytest.approx(0.14, rel=0.2)
    assert abs(np.log(result.intrinsics.fx / camera.fx)) < 4 * result.focal_sigma + 1e-4


def test_too_few_views_are_refused_with_how_many_there_are():
    with pytest.raises(DepthPersonError, match='5 different views of the board are too few'):
        calibrate(exact_views(CAMERAS['plumb_bob'], 5))


def test_a_board_in_one_corner_of_the_image_is_refused():
    views = exact_views(CAMERAS['plumb_bob'], 60)
    corner = BoardViews(*SIZE, [
        BoardView(view.board, (view.image / 3).astype(np.float32)) for view in views.views])
    with pytest.raises(DepthPersonError, match='of the image only'):
        calibrate(corner)


def test_views_without_tilt_are_too_alike():
    with pytest.raises(DepthPersonError, match='too alike'):
        calibrate(exact_views(CAMERAS['plumb_bob'], 24, noise=0.3, tilt=0.0))


def test_the_same_view_counts_once():
    views = BoardViews(*SIZE)
    one = exact_views(CAMERAS['plumb_bob'], 1).views[0]
    moved = BoardView(one.board, one.image + np.float32(30))
    assert [views.offer(view) for view in (one, one, moved)] == [True, False, True]


def test_a_view_with_mistaken_corners_is_left_out():
    views = exact_views(CAMERAS['plumb_bob'], 24, noise=0.1)
    views.views[3] = BoardView(views.views[3].board, views.views[3].image[::-1] + np.float32(7))
    views.views[7] = BoardView(views.views[7].board, np.roll(views.views[7].image, 1, axis=0))
    result = calibrate(views)
    assert result.outliers >= 1
    assert result.intrinsics.fx == pytest.approx(CAMERAS['plumb_bob'].fx, rel=0.005)


def test_a_charuco_board_is_found_in_part_or_the_lack_of_markers_is_named():
    def board():
        return CharucoBoard(7, 5, square=0.04, marker=0.03, dictionary='4X4_50')

    if not hasattr(cv2, 'aruco'):
        with pytest.raises(DepthPersonError, match='without markers'):
            board()
        return
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    if hasattr(cv2.aruco, 'CharucoBoard_create'):  # OpenCV before 4.7
        picture = cv2.aruco.CharucoBoard_create(7, 5, 0.04, 0.03, dictionary).draw((840, 600))
    else:
        drawn = cv2.aruco.CharucoBoard((7, 5), 0.04, 0.03, dictionary)
        picture = drawn.generateImage((840, 600))
    image = cv2.copyMakeBorder(picture, *[60] * 4, cv2.BORDER_CONSTANT, value=255)
    whole = board().find(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    part = board().find(cv2.cvtColor(image[:, :560], cv2.COLOR_GRAY2BGR))
    assert len(whole) == 24
    assert 8 <= len(part) < 24
    # 120 px a square, the board's own origin in its corner.
    np.testing.assert_allclose(whole.image, whole.board / 0.04 * 120 + 59.5, atol=0.6)
    assert board().find(np.full((480, 640, 3), 200, np.uint8)) is None


@pytest.mark.parametrize(('arguments', 'complaint'), [
    (['--chessboard', '9x6'], 'how large a square'),
    (['--chessboard', '2x6', '--square', '0.04'], 'too small'),
    (['--chessboard', '9x6', '--square', '40'], 'in metres'),
    (['--chessboard', '9x6', '--fov', '70', '--square', '0.04'], 'give one of'),
    ([], 'give one of'),
])
def test_wrong_options_are_one_clear_message(tmp_path, capsys, arguments, complaint):
    cv2.imwrite(str(tmp_path / '0.png'), np.zeros((480, 640, 3), np.uint8))
    assert main(['calibrate', str(tmp_path), '-o', str(tmp_path / 'c.yaml'), *arguments]) == 1
    assert complaint in capsys.readouterr().err
    assert not (tmp_path / 'c.yaml').exists()


def test_images_without_the_board_are_refused(tmp_path, capsys):
    cv2.imwrite(str(tmp_path / '0.png'), np.zeros((480, 640, 3), np.uint8))
    assert main(['calibrate', str(tmp_path), '--chessboard', '9x6', '--square', '0.04',
                 '-o', str(tmp_path / 'c.yaml')]) == 1
    assert '0 different views' in capsys.readouterr().err


@pytest.mark.parametrize(('option', 'degrees', 'focal_length'), [
    ('--fov', '90', 640.0), ('--diagonal-fov', '90', 734.3)])
def test_a_field_of_view_gives_the_pinhole(tmp_path, option, degrees, focal_length):
    out = tmp_path / 'camera.yaml'
    assert main(['calibrate', option, degrees, '--size', '1280x720', '-o', str(out)]) == 0
    _, found = load_camera_info(str(out))
    assert found.fx == pytest.approx(focal_length, abs=0.1)
    assert (found.width, found.height, found.cx) == (1280, 720, 639.5)
    assert main(['calibrate', option, '60', '--size', '1280x720', '-o', str(out)]) == 1
    assert load_camera_info(str(out))[1] == found
