"""The page of a report and what it is made of, as HTML."""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from string import Template

#: Nothing may be loaded from anywhere, and no script may run.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="$policy">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 15px/1.45 sans-serif; margin: 1.5em auto; max-width: 76em; padding: 0 1em;
       color: #222; background: #fff; }
h1 { font-size: 1.5em; } h2 { font-size: 1.2em; margin-top: 2em; }
h1, p, li { overflow-wrap: anywhere; }
table { border-collapse: collapse; margin: 0.6em 0; display: block; overflow-x: auto; }
th, td { padding: 0.15em 0.8em; text-align: right; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child, .texts td:nth-child(2), .texts th:nth-child(2) {
  text-align: left; }
td:first-child { white-space: nowrap; }
img { max-width: 100%; height: auto; }
.frames { display: grid; gap: 1em;
          grid-template-columns: repeat(auto-fill, minmax(min(34em, 100%), 1fr)); }
figure { margin: 0; } figcaption { color: #555; }
.drawing { overflow-x: auto; } .drawing img { max-width: max(100%, 36em); }
.faults { background: #fdecea; padding: 0.6em 1em; }
</style>
</head>
<body>
<h1>$title</h1>
$body
</body>
</html>
""")


def page(title: str, body: str) -> str:
    """Return a page."""
    return _PAGE.substitute(policy=_POLICY, title=escape(title), body=body)


def paragraphs(lines: Iterable[str]) -> str:
    """Return each line as a paragraph."""
    return ''.join(f'<p>{escape(line)}</p>' for line in lines)


def faults_box(title: str, faults: Sequence[str]) -> str:
    """Return a box that lists what was amiss; nothing where nothing was."""
    if not faults:
        return ''
    items = ''.join(f'<li>{escape(fault)}</li>' for fault in faults)
    return f'<div class="faults"><b>{escape(title)}</b><ul>{items}</ul></div>'


def figure(title: str, uri: str, caption: str) -> str:
    """Return a drawing under a heading."""
    name = escape(title.lower().replace(' ', '-').replace("'", ''))
    return f'<h2 id="{name}">{escape(title)}</h2>' + picture(title, uri, caption)


def picture(title: str, uri: str, caption: str, *, kind: str = 'drawing') -> str:
    """Return a picture; a drawing stays so large that its text can be read."""
    return (f'<figure class="{kind}"><img alt="{escape(title)}" src="{uri}">'
            f'<figcaption>{escape(caption)}</figcaption></figure>')


def table(
    headings: Sequence[str], rows: Iterable[Sequence[str]], *, kind: str = 'numbers',
) -> str:
    """Return a table; the second column of one of texts begins at its left, too."""
    def line(cells: Sequence[str], tag: str) -> str:
        return '<tr>' + ''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in cells) + '</tr>'

    head = line(headings, 'th') if any(headings) else ''
    return f'<table class="{kind}">{head}{"".join(line(row, "td") for row in rows)}</table>'
