"""Folders of unfinished stages, and a folder that takes the place of another one."""

import os
import time
from pathlib import Path

import pytest

from reproduction.scratch import replace_folder, scratch_folder
from robojoule.errors import InputError


def test_the_key_is_of_parameters_and_inputs(tmp_path: Path):
    first = scratch_folder(tmp_path, {"a": 1, "b": 2}, [b"x", b"y"])
    assert scratch_folder(tmp_path, {"b": 2, "a": 1}, [b"x", b"y"]) == first
    others = [({"a": 2, "b": 2}, [b"x", b"y"]), ({"a": 1, "b": 2}, [b"xy"]), ({"a": 1, "b": 2}, [b"x", b"z"])]
    assert len({first, *(scratch_folder(tmp_path, *one) for one in others)}) == 4


def test_what_was_begun_goes_and_what_is_finished_stays(tmp_path: Path):
    folder = scratch_folder(tmp_path, {}, [])
    (folder / ".begun.parquet").write_bytes(b"half")
    (folder / "part.parquet").write_bytes(b"whole")
    assert scratch_folder(tmp_path, {}, []) == folder
    assert [path.name for path in folder.iterdir()] == ["part.parquet"]


def test_what_nobody_came_back_for_goes_after_a_week(tmp_path: Path):
    old, recent = scratch_folder(tmp_path, {"a": 1}, []), scratch_folder(tmp_path, {"a": 2}, [])
    os.utime(old, (0, time.time() - 8 * 24 * 3600))
    scratch_folder(tmp_path, {"a": 3}, [])
    assert not old.exists() and recent.exists()


def test_a_folder_is_replaced_when_the_new_one_is_complete(tmp_path: Path):
    target, part = tmp_path / "samples", tmp_path / "part"
    target.mkdir()
    (target / "old").write_bytes(b"old")
    part.write_bytes(b"new")
    with pytest.raises(InputError, match="samples: the folder cannot be written"):
        replace_folder(target, {"a": part, "b": tmp_path / "nowhere"})
    assert [path.name for path in target.iterdir()] == ["old"]
    replace_folder(target, {"a": part})
    assert {path.name: path.read_bytes() for path in target.iterdir()} == {"a": b"new"}
    assert part.exists() and sorted(path.name for path in tmp_path.iterdir()) == ["part", "samples"]


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path):
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(InputError, match="nothing can be written there"):
        scratch_folder(tmp_path / "file", {}, [])
