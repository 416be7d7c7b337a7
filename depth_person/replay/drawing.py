"""What all pictures need of matplotlib."""
from __future__ import annotations

from base64 import b64encode
from io import BytesIO

from depth_person.errors import DepthPersonError
from depth_person.overlay import person_colour

try:
    from matplotlib import colormaps, rc_context
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
except ImportError as error:
    raise DepthPersonError(
        'plots need matplotlib; install it with: pip install "depth_person[demo]"') from error

__all__ = ['Axes', 'Figure', 'as_uri', 'colormaps', 'rgb']


def rgb(track_id: int) -> tuple[float, float, float]:
    """Return the colour that the overlay gives a track."""
    blue, green, red = person_colour(track_id)
    return red / 255, green / 255, blue / 255


def as_uri(figure: Figure) -> str:
    """Return a figure as an SVG in a data URI; the same figure gives the same text."""
    buffer = BytesIO()
    with rc_context({'svg.hashsalt': 'depth_person'}):
        figure.savefig(buffer, format='svg', metadata={'Date': None})
    return f'data:image/svg+xml;base64,{b64encode(buffer.getvalue()).decode("ascii")}'
