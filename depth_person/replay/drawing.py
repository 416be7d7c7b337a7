"""What all pictures need of matplotlib."""
from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
#: A legend names so many, and says how many more there are.
MOST_NAMES = 16
#: Of red, green and blue to how bright a colour looks; and the brightest that shows on white.
_BRIGHTNESS, _BRIGHTEST = (0.30, 0.59, 0.11), 0.6

__all__ = [
    'Axes', 'Figure', 'as_uri', 'at_rows', 'colormaps', 'legend', 'rgb', 'save_figures', 'strands']

#: Red, green and blue, 0 to 1.
Colour = tuple[float, float, float]
#: The name, style and colour of a line in a legend.
Entry = tuple[str, str, Colour]


def rgb(track_id: int) -> Colour:
    """Return the colour that the overlay gives a track, darker where white would swallow it."""
    blue, green, red = (part / 255 for part in person_colour(track_id))
    bright = sum(
        share * part for share, part in zip(_BRIGHTNESS, (red, green, blue), strict=True))
    scale = min(1.0, _BRIGHTEST / max(bright, 1e-3))
    return scale * red, scale * green, scale * blue


def strands(
    track_ids: NDArray[np.int64], times: NDArray[Any],
) -> Iterator[tuple[Colour, NDArray[np.intp]]]:
    """
    Yield each colour and the rows that have it, track by track in time, with -1 between tracks.

    So thousands of tracks are drawn as a few lines with gaps in them.
    """
    order = np.lexsort((times, track_ids))
    edges = np.flatnonzero(np.diff(track_ids[order])) + 1
    found: dict[Colour, list[NDArray[np.intp]]] = {}
    for rows in np.split(order, edges) if len(order) else ():
        found.setdefault(rgb(int(track_ids[rows[0]])), []).extend([rows, np.array([-1])])
    for colour, parts in found.items():
        yield colour, np.concatenate(parts)


def at_rows(values: NDArray[Any], rows: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the values of rows, NaN for -1."""
    return np.where(
        (rows >= 0).reshape(-1, *(1,) * (values.ndim - 1)), values[rows], np.nan)


def legend(axes: Axes, entries: Sequence[Entry], *, ncols: int = 9) -> None:
    """
    Add a legend of these and of what has a label, above the axes, where it hides nothing.

    Of very many it names some, and says how many more there are.
    """
    if len(entries) > MOST_NAMES:
        more: Entry = (f'and {len(entries) - MOST_NAMES} more', ' ', (0, 0, 0))
        entries = [*entries[:MOST_NAMES], more]
    for name, style, colour in entries:
        axes.plot([], [], style, color=colour, label=name)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(
            fontsize='small', ncols=ncols, loc='lower left', bbox_to_anchor=(0, 1), frameon=False)


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
