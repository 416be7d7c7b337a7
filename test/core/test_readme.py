"""The README and the page of parameters say what the code has."""
from pathlib import Path
import re

import parameter_tables

from depth_person.cli import VERBS

ROOT = Path(__file__).parents[2]
README = (ROOT / 'README.md').read_text()


def test_the_page_of_parameters_is_that_of_the_code():
    assert parameter_tables.PAGE.read_text() == parameter_tables.page(), (
        'run: python test/parameter_tables.py')


def test_every_page_that_the_readme_names_exists():
    pages = re.findall(r'\]\((?!http|#)([^)#]+)\)', README)
    assert pages
    assert [page for page in pages if not (ROOT / page).exists()] == []


def test_the_readme_names_every_verb():
    assert [verb for verb in VERBS if f'`{verb}`' not in README] == []
