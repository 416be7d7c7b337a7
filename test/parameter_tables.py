"""
Writes msg_docs/parameters.md from the parameters in the code.

    python test/parameter_tables.py
"""
from pathlib import Path

from depth_person.settings.parameter import ParameterSpec
from depth_person.settings.table import PARAMETERS

PAGE = Path(__file__).parents[1] / 'msg_docs' / 'parameters.md'
HEAD = """# Parameters

In a parameter file such as `config/depth_person.yaml`, or with `--ros-args -p name:=value`. Those
that are not read-only can be changed while the node runs. What is out of range is refused with the
reason; an integer is taken for a double. Every QoS profile can be overridden, such as
`qos_overrides./image_raw.subscription.reliability: reliable`.

This page is written from the code by `python test/parameter_tables.py`.
"""
COLUMNS = ('parameter', 'type', 'default', 'values', 'read-only', 'meaning')


def page() -> str:
    """Return the page."""
    return HEAD + ''.join(
        f'\n## {node}\n\n' + table([row(spec) for spec in specs])
        for node, specs in PARAMETERS.items())


def table(rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [list(COLUMNS), ['---'] * len(COLUMNS), *rows]
    return ''.join('| ' + ' | '.join(line) + ' |\n' for line in lines)


def row(spec: ParameterSpec) -> list[str]:
    """Return the cells of one parameter."""
    default = str(spec.default).lower() if isinstance(spec.default, bool) else str(spec.default)
    values = ', '.join(f'`{choice}`' for choice in spec.choices)
    if spec.minimum > float('-inf'):
        values = f'{spec.minimum:g} to {spec.maximum:g}'
    return [f'`{spec.name}`', spec.type_name, f'`{default}`' if default else '', values,
            'yes' if spec.read_only else 'no', spec.description]


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
