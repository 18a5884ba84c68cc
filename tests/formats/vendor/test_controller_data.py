"""What stands in the controller, as a file and as options."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.vendor.controller_data import frame, read_controller_data, wait_of

GOOD = """\
format: robojoule-controller-data
version: 1
tools:
  "1": {xyz_mm: [0, 0, 120], rpy_deg: [0, 0, 90]}
bases:
  table: {xyz_mm: [800, -300, 400]}
payloads:
  "2": {mass_kg: 4.5, com_mm: [0, 10, 80]}
waits_s:
  "12": 1.5
"""


def read(folder, text):
    (folder / "data.yaml").write_text(text)
    return read_controller_data(folder / "data.yaml")


def test_a_file_gives_all_of_it(tmp_path):
    found = read(tmp_path, GOOD)
    assert found.tools["1"].origin_m == pytest.approx([0, 0, 0.12])
    assert found.tools["1"].at([0.1, 0, 0]) == pytest.approx([0, 0.1, 0.12])  # x turned to y
    assert found.bases["table"].origin_m == pytest.approx([0.8, -0.3, 0.4])
    assert (found.payloads["2"].mass_kg, found.payloads["2"].com_m) == (4.5, (0.0, 0.01, 0.08))
    assert found.waits_s == {12: 1.5}


BAD = {
    "another key": (GOOD + "speed: 3\n", "speed"),
    "a tool without numbers": (GOOD.replace("[0, 0, 120]", "[0, 0]"), "tools.1.xyz_mm"),
    "a tool in metres of kilometres": (GOOD.replace("120", "1e7"), "the frame is too far away"),
    "a wait in a word": (GOOD.replace('"12"', "twelve"), "'twelve' is not the number of a line"),
    "a mass below zero": (GOOD.replace("4.5", "-1"), "payloads.2.mass_kg"),
    "another format": (GOOD.replace("controller-data", "cell"), "format"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_gets_one_sentence(tmp_path, name):
    text, message = BAD[name]
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_frames_turn_about_fixed_axes_x_first():
    """KUKA's A, B, C turn about z, the new y, the new x: the same as C, B, A about fixed x, y, z."""
    a, b, c = np.radians([30.0, 20.0, 10.0])
    about = {
        "z": [[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]],
        "y": [[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]],
        "x": [[1, 0, 0], [0, np.cos(c), -np.sin(c)], [0, np.sin(c), np.cos(c)]],
    }
    wanted = np.array(about["z"]) @ np.array(about["y"]) @ np.array(about["x"])
    assert np.allclose(frame(1, 2, 3, 10, 20, 30).rotation, wanted)


@pytest.mark.parametrize("text", ["12", "=3", "12=", "12=x", "a=3", "12=-1", "12=1e9", "1.5=2"])
def test_a_wait_is_a_line_and_seconds(text):
    assert wait_of("12=1.5") == wait_of(" 12 = 1.5s") == (12, 1.5)
    with pytest.raises(InputError, match="is not a wait"):
        wait_of(text)
