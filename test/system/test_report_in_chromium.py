"""A regression bag, processed and reported, as a browser without a network shows it."""
from pathlib import Path
import subprocess
import sys

from chromium import Chromium
import cv2
import pytest

BAG = Path(__file__).parents[1] / 'regression' / 'bags' / 'walker'
BIN = Path(sys.executable).parent


@pytest.fixture(scope='module')
def page(tmp_path_factory):
    """Return the report about a regression bag, made by the commands that a user gives."""
    folder = tmp_path_factory.mktemp('report')
    for command in (
            ['process', BAG, '-o', folder / 'results', '--quiet'],
            ['report', folder / 'results', '--truth', '/person_truth', '-o',
             folder / 'report.html']):
        subprocess.run([BIN / 'depth_person', *command], check=True, timeout=120)
    return folder / 'report.html'


def test_the_results_of_process_are_the_golden_ones(page):
    golden = BAG.parents[1] / 'golden' / 'walker.json'
    compared = subprocess.run(
        [BIN / 'depth_person', 'compare', golden, page.parent / 'results'], timeout=120,
        stdout=subprocess.PIPE, text=True, check=False)
    assert compared.returncode == 0, compared.stdout


@pytest.fixture(scope='module')
def browser(page):
    with Chromium() as result:
        result.open(page)
        yield result


def test_nothing_but_the_page_is_asked_for(browser, page):
    assert set(browser.requests) == {page.as_uri()}
    assert browser.complaints == []


def test_every_picture_is_shown(browser):
    widths = browser.evaluate('[...document.images].map(image => image.naturalWidth)')
    assert len(widths) >= 10
    assert min(widths) > 300


def test_nothing_is_wider_than_the_window(browser):
    assert browser.evaluate('document.documentElement.scrollWidth') <= 1200


def test_nothing_is_wider_than_a_telephone(browser, page):
    browser.open(page, width=390)
    try:
        assert browser.evaluate('document.documentElement.scrollWidth') <= 390
        drawing, sample = (browser.evaluate(
            f'document.querySelector(".{kind} img").clientWidth') for kind in (
                'drawing', 'sample'))
        assert drawing > 450  # scrolled, with text that can be read
        assert sample <= 390
    finally:
        browser.open(page)


def test_the_errors_stand_in_a_table(browser):
    cells = browser.evaluate(
        '[...document.querySelectorAll("#errors + table td")].map(cell => cell.innerText)')
    assert cells[:3] == ['all', '11', '100%']


def test_a_screenshot_shows_the_whole_page(browser, page):
    picture = page.with_suffix('.png')
    browser.screenshot(picture)
    shown = cv2.imread(str(picture))
    height, width = shown.shape[:2]
    assert width >= 1200
    assert height >= 2000
    bands = [band.std() for band in (shown[:height // 3], shown[height // 3:2 * height // 3],
                                     shown[2 * height // 3:])]
    assert min(bands) > 10
