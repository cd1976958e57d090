"""Plots and pages in notebooks."""

from __future__ import annotations

import html
import re

import numpy as np
import pytest
from conftest import unit

import tumble


@pytest.fixture
def clip(rng):
    return tumble.Clip([0.0, 0.5, 2.0], unit(rng, 2, 3), names=["hip", "knee"])


def test_plots(clip):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = clip.plot("knee", method="slerp")
    lines = axes.get_lines()
    assert len(lines) == 8 and axes.get_title() == "knee"
    for curve, dots in zip(lines[::2], lines[1::2]):
        (times, values), (key_times, keys) = curve.get_data(), dots.get_data()
        assert len(times) == 241 and key_times.tolist() == [0.0, 0.5, 2.0]
        assert np.allclose(values[[0, 60, 240]], keys)
    assert clip.plot(0, axes=axes) is axes and len(axes.get_lines()) == 16
    axes.figure.canvas.draw()


def test_pages(clip, tmp_path):
    page = clip.view(methods=["slerp", "c2"], fps=30)
    assert page.html.startswith("<!doctype html>")
    assert not re.search(r"""(?:src|href)=["']https?:""", page.html), "needs no network"
    shown = page._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and shown.count("<") == 2
    source = re.match(r'<iframe srcdoc="([^"]*)"', shown)
    assert source and html.unescape(source[1]) == page.html
    page.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == page.html
    assert "MB of HTML" in repr(page)
    with pytest.raises(tumble.InputError, match="slurp"):
        clip.view(methods="slurp")
