"""Output for notebooks: plots of clips, and the page of `tumble view`."""

from __future__ import annotations

import html as _html
import os
from collections.abc import Iterable
from typing import Any

from tumble import _tumble
from tumble._files import whole


def plot(clip: Any, track: Any, fps: Any, axes: Any, **options: Any) -> Any:
    """Draws a track; see `Clip.plot`."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("Clip.plot draws with matplotlib: pip install matplotlib") from error
    import numpy as np

    track = 0 if track is None else track
    index = clip.names.index(track) if isinstance(track, str) else track
    first, last = clip.span
    rate = 120 if fps is None else fps
    count = clip.frames(rate)
    times = np.linspace(first, first + (count - 1) / _per_second(rate), count)
    curve = clip.evaluate(at=times, **options)[index]
    keys, key_times = clip.keys(index), clip.times(index)
    # A key is drawn with the sign that the curve has there; both are the same rotation.
    near = clip.evaluate(at=key_times, **options)[index]
    keys = np.where((keys * near).sum(axis=1, keepdims=True) < 0, -keys, keys)
    if axes is None:
        axes = pyplot.subplots(figsize=(9, 3.5), layout="constrained")[1]
    colours = {"x": "#d55e00", "y": "#009e73", "z": "#0072b2", "w": "#22262b"}
    for component, (name, colour) in enumerate(colours.items()):
        axes.plot(times, curve[:, component], color=colour, label=name, linewidth=1.2)
        axes.plot(key_times, keys[:, component], "o", color=colour, markersize=3)
    axes.set(xlabel="seconds", title=clip.names[index], xlim=(first, max(last, times[-1])))
    axes.legend(loc="upper right", ncols=4)
    return axes


def _per_second(rate: Any) -> float:
    from fractions import Fraction

    return float(Fraction(str(rate)))


class View:
    """A page that shows clips moving: HTML that needs nothing beside it."""

    def __init__(self, html: str, height: int) -> None:
        self.html = html
        self.height = height

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the page to a file."""
        with whole(path) as partial, open(partial, "w", encoding="utf-8") as file:
            file.write(self.html)

    def _repr_html_(self) -> str:
        page = _html.escape(self.html, quote=True)
        return (
            f'<iframe srcdoc="{page}" width="100%" height="{self.height}" '
            'style="border: 0" title="tumble view" allowfullscreen></iframe>'
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, View):
            return NotImplemented
        return (self.html, self.height) == (other.html, other.height)

    def __hash__(self) -> int:
        return hash((self.html, self.height))

    def __repr__(self) -> str:
        return f"View({len(self.html) / 1e6:.1f} MB of HTML)"


def view(
    clip: Any,
    *,
    methods: str | Iterable[str] | None = None,
    fps: Any = 60,
    start: float | None = None,
    end: float | None = None,
    height: int = 520,
) -> View:
    """Makes the page; see `Clip.view`."""
    options = [f"--fps={fps}"]
    if methods is not None:
        names = [methods] if isinstance(methods, str) else list(methods)
        options.append("--method=" + ",".join(names))
    options += [f"--start={start}"] if start is not None else []
    options += [f"--end={end}"] if end is not None else []
    return View(_tumble.page(clip, options), height)
