"""What all pictures need of matplotlib."""
from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from depth_person.errors import DepthPersonError
from depth_person.overlay import person_colour

try:
    from matplotlib import colormaps, rc_context
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
except ImportError as error:
    raise DepthPersonError(
        'plots need matplotlib; install it with: pip install "depth_person[demo]"') from error

#: A figure of more is drawn in pixels.
MOST_POINTS = 5000

__all__ = ['Axes', 'Figure', 'as_uri', 'colormaps', 'rgb', 'save_figures']


def rgb(track_id: int) -> tuple[float, float, float]:
    """Return the colour that the overlay gives a track."""
    blue, green, red = person_colour(track_id)
    return red / 255, green / 255, blue / 255


def as_uri(figure: Figure, *, points: int = 0) -> str:
    """
    Return a figure as a picture in a data URI; the same figure gives the same text.

    :param points: about how many it shows: an SVG of very many is slow to show, a PNG is not.
    """
    kind, name = ('png', 'png') if points > MOST_POINTS else ('svg', 'svg+xml')
    buffer = BytesIO()
    with rc_context({'svg.hashsalt': 'depth_person'}):
        figure.savefig(
            buffer, format=kind, dpi=110, metadata={'Date': None} if kind == 'svg' else {})
    return f'data:image/{name};base64,{b64encode(buffer.getvalue()).decode("ascii")}'


def save_figures(figures: Mapping[str, Figure], folder: Path) -> list[Path]:
    """
    Write figures by their file names into a folder, which is made; return the files.

    :raises DepthPersonError: when the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, figure in figures.items():
            figure.savefig(folder / name, dpi=110)
    except OSError as error:
        raise DepthPersonError(f'cannot write to {folder}: {error.strerror}') from error
    return [folder / name for name in figures]
