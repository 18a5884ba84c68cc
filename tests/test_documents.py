"""Files in and out: messages for people, atomic writes."""

from pathlib import Path

import pytest
from pydantic import Field

from robojoule.documents import (
    Document,
    all_or_none,
    atomic_path,
    check_output,
    load,
    read_document,
    write_document,
    write_files,
    write_text,
)
from robojoule.errors import InputError
from robojoule.inputs import as_path


class Inner(Document):
    size_m: float = Field(gt=0)


class Outer(Document):
    name: str
    inner: Inner
    count: int = 1


BAD = {
    "missing file": (None, "there is no such file"),
    "truncated json": ('{"name": "a", "inner": {', "cannot be read"),
    "duplicate key": ('{"name": "a", "name": "b", "inner": {"size_m": 1}}', "key 'name' appears twice"),
    "unknown key": ('{"name": "a", "inner": {"size_m": 1, "sise": 2}}', "inner.sise: unknown key; allowed: size_m"),
    "missing key": ('{"name": "a", "inner": {}}', "inner.size_m: this key is missing"),
    "out of range": ('{"name": "a", "inner": {"size_m": -1}}', "inner.size_m: input should be greater than 0"),
    "not finite": ('{"name": "a", "inner": {"size_m": NaN}}', "inner.size_m: "),
    "wrong type": ('{"name": 3, "inner": {"size_m": 1}}', "name: input should be a valid string"),
    "misspelt instead of missing": ('{"nmae": "a", "inner": {"size_m": 1}}', "nmae: unknown key"),
    "no mapping": ("[1, 2]", ""),
}


@pytest.mark.parametrize("text, message", BAD.values(), ids=BAD.keys())
def test_bad_files_give_one_clear_sentence(tmp_path, text, message):
    path = tmp_path / "file.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError) as caught:
        load(Outer, path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_yaml_duplicate_keys_are_refused(tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text("a: 1\nb: 2\na: 3\n")
    with pytest.raises(InputError, match="key 'a' appears twice"):
        read_document(path)


@pytest.mark.parametrize("suffix", [".json", ".yaml"])
def test_round_trip(tmp_path, suffix):
    path = tmp_path / f"file{suffix}"
    data = {"name": "ü", "inner": {"size_m": 0.1}, "count": 2}
    write_document(path, data)
    assert read_document(path) == data
    assert load(Outer, path) == Outer(name="ü", inner=Inner(size_m=0.1), count=2)


def test_unknown_suffix_is_refused(tmp_path):
    for action in (read_document, lambda path: write_document(path, {})):
        with pytest.raises(InputError, match=r"unknown file type '\.txt'"):
            action(tmp_path / "file.txt")
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_nothing_behind(tmp_path):
    path = tmp_path / "out.txt"
    path.write_text("before")
    with pytest.raises(ZeroDivisionError), atomic_path(path) as temporary:
        temporary.write_text("half")
        raise ZeroDivisionError
    assert path.read_text() == "before"
    assert [p.name for p in tmp_path.iterdir()] == ["out.txt"]


def test_several_files_are_written_all_or_none(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "a.txt").write_text("before")
    for name, text, message in (
        ("folder", "text", "this is a folder"),
        ("b.txt", "\ud800", "the file cannot be written"),
    ):
        with pytest.raises(InputError, match=f"{name}: {message}"):
            write_files({tmp_path / "a.txt": "after", tmp_path / name: text, tmp_path / "c.bin": b"\0"})
        assert (tmp_path / "a.txt").read_text() == "before"
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a.txt", "folder"]
    write_files({tmp_path / "a.txt": "after\n", tmp_path / "c.bin": b"\0"})
    assert ((tmp_path / "a.txt").read_bytes(), (tmp_path / "c.bin").read_bytes()) == (b"after\n", b"\0")


NOT_WRITABLE = {
    "below a file": "file/out.json",
    "a folder": "folder.json",
    "no name": "a\0.json",
    "long": "x" * 300 + ".json",
}


@pytest.mark.parametrize("name", NOT_WRITABLE.values(), ids=NOT_WRITABLE.keys())
def test_where_nothing_can_be_written(tmp_path, name):
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / "folder.json").mkdir()
    refused = r"the file cannot be written|this is a folder|there is no folder|no file can have this name"
    with pytest.raises(InputError, match=refused):
        write_document(tmp_path / name, {})
    with pytest.raises(InputError, match=refused):
        check_output(as_path(str(tmp_path / name), "out"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this platform has no device that is always full")
def test_a_full_disk_is_said(tmp_path):
    """The device stands for the temporary file: writing to it fails as on a full disk."""
    message = r"out\.txt: the file cannot be written \(No space left on device\)"
    with pytest.raises(InputError, match=message), atomic_path(tmp_path / "out.txt") as temporary:
        temporary.unlink()
        temporary.symlink_to("/dev/full")
        temporary.write_text("text")
    assert list(tmp_path.iterdir()) == []


def test_files_that_belong_together_appear_together(tmp_path):
    with pytest.raises(ZeroDivisionError), all_or_none():
        write_text(tmp_path / "a.txt", "a")
        write_text(tmp_path / "b.txt", "b")
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    with all_or_none():
        write_text(tmp_path / "a.txt", "a")
        write_text(tmp_path / "b.txt", "b")
        assert not (tmp_path / "a.txt").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.txt", "b.txt"]
    write_text(tmp_path / "c.txt", "c")
    assert (tmp_path / "c.txt").exists()
