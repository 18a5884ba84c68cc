"""One way in and out for programs of every format."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.program import Program, load_program
from robojoule.formats.registry import FORMATS, format_of
from robojoule.formats.vendor.files import VendorFiles
from robojoule.programs.operation_tree import tree_from_configurations

SUFFIXES = [suffix for one in FORMATS for suffix in one.suffixes]
OWN = [suffix for one in FORMATS if not isinstance(one, VendorFiles) for suffix in one.suffixes]


def program() -> Program:
    tree = tree_from_configurations("there-and-back", [[0.0, 1 / 3], [0.1 + 0.2, -1.0], [0.0, 1 / 3]])
    return Program(tree.with_plan({"move-1": 100 / 3}, waits_before_s={"move-2": 0.25}, waits_after_s={"move-2": 0.1}))


def test_no_two_formats_share_a_name_or_a_suffix():
    assert len({one.name for one in FORMATS}) == len(FORMATS)
    assert len(set(SUFFIXES)) == len(SUFFIXES)
    assert all(suffix == suffix.lower() and suffix.startswith(".") for suffix in SUFFIXES)


@pytest.mark.parametrize("suffix", OWN)
def test_what_a_format_writes_it_reads(tmp_path, suffix):
    path = tmp_path / f"there-and-back{suffix}"
    program().save(str(path))
    read = load_program(str(path))
    assert read.tree == program().tree
    assert (read.path, read.format) == (path, format_of(path).name)
    first = path.read_bytes()
    read.save(path)
    assert path.read_bytes() == first
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_suffixes_may_be_in_capitals(tmp_path):
    program().save(tmp_path / "A.CSV")
    np.testing.assert_array_equal(
        load_program(tmp_path / "A.CSV").tree.configurations_rad(), program().tree.configurations_rad()
    )


@pytest.mark.parametrize("name, shown", [("cycle.krl", "'.krl'"), ("cycle", "''")])
def test_an_unknown_suffix_names_the_known_ones(tmp_path, name, shown):
    known = ".yaml, .yml, .json (operation tree), .csv (joint positions), .src (KUKA KRL), "
    known += ".ls (FANUC TP), .mod, .prg (ABB RAPID), .script (URScript)"
    message = f"{tmp_path / name}: unknown file type {shown}; allowed: {known}"
    for action in (load_program, program().save):
        with pytest.raises(InputError) as caught:
            action(tmp_path / name)
        assert str(caught.value) == message
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_missing_file_is_said_so(tmp_path, suffix):
    with pytest.raises(InputError, match="there is no such file"):
        load_program(tmp_path / f"none{suffix}")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_folder_or_bytes_are_no_program(tmp_path, suffix):
    (tmp_path / f"folder{suffix}").mkdir()
    (tmp_path / f"bytes{suffix}").write_bytes(b"\xff\xfe\x00q1")
    for name in ("folder", "bytes"):
        with pytest.raises(InputError, match=r"this is a folder|is UTF-16, not UTF-8 text|not 8-bit text"):
            load_program(tmp_path / f"{name}{suffix}")


def test_languages_with_durations_and_speeds_take_finer_steps():
    steps = {one.name: one.speed_step_percent for one in FORMATS}
    assert steps["KUKA KRL"] == steps["FANUC TP"] == steps["operation tree"] == 1.0
    assert steps["ABB RAPID"] == steps["URScript"] == 0.1
