import xml.etree.ElementTree as ET

import pytest

from robojoule.errors import InputError
from robojoule.plots.style import Style, svg_text


def test_size_follows_width():
    with Style(width_in=5.0).applied():
        figure, ax = Style(width_in=5.0).figure(0.5)
        ax.plot([0, 1], [0, 1])
        root = ET.fromstring(svg_text(figure))
    assert (root.get("width"), root.get("height")) == ("360pt", "180pt")


def test_no_date_version_or_creator():
    with Style().applied():
        figure, _ = Style().figure()
        text = svg_text(figure)
    assert "<dc:date>" not in text and "dc:creator" not in text and "matplotlib v" not in text.lower()


def test_unknown_colormap_is_bad_input():
    with (
        pytest.raises(InputError, match=r"draw_figures\.colormap.*no colour map 'viridish'"),
        Style(colormap="viridish").applied(),
    ):
        pass


@pytest.mark.parametrize("count", [1, 2, 7])
def test_colors_are_distinct_and_leave_out_the_light_end(count: int):
    import matplotlib

    colors = Style(colormap="viridis").colors(count)
    assert len(set(colors)) == count
    assert matplotlib.colormaps["viridis"](1.0) not in colors


def test_settings_of_matplotlib_do_not_leak():
    import matplotlib

    before = matplotlib.rcParams["svg.hashsalt"]
    with Style().applied():
        assert matplotlib.rcParams["svg.hashsalt"] == "robojoule"
    assert matplotlib.rcParams["svg.hashsalt"] == before
