"""The README's tables say what the code does."""
from pathlib import Path
import re

import pytest

from depth_person.settings.table import PARAMETERS

README = (Path(__file__).parents[2] / 'README.md').read_text()


def table(section):
    """Return the rows of the first table below a heading of the README."""
    below = README.partition(f'\n### {section}\n')[2].partition('\n#')[0]
    rows = [line for line in below.splitlines() if line.startswith('|')]
    return [[cell.strip() for cell in re.split(r'(?<!\\)\|', row)[1:-1]] for row in rows[2:]]


def shown(spec):
    """Return the row of one parameter as the README has it."""
    default = str(spec.default).lower() if isinstance(spec.default, bool) else str(spec.default)
    limits = ', '.join(f'`{choice}`' for choice in spec.choices)
    if spec.minimum > float('-inf'):
        limits = f'{spec.minimum:g} to {spec.maximum:g}'
    return [f'`{spec.name}`', spec.type_name, f'`{default}`' if default else '', limits,
            'yes' if spec.read_only else 'no', spec.description]


@pytest.mark.parametrize('node', PARAMETERS)
def test_parameter_tables_are_those_of_the_code(node):
    expected = [shown(spec) for spec in PARAMETERS[node]]
    assert table(node) == expected, '\n'.join('| ' + ' | '.join(row) + ' |' for row in expected)


def test_every_page_that_the_readme_names_exists():
    pages = re.findall(r'\]\((?!http|#)([^)]+)\)', README)
    assert pages
    assert [page for page in pages if not (Path(__file__).parents[2] / page).exists()] == []
