"""Files in and out: messages for people, atomic writes."""

import pytest
from pydantic import Field

from robojoule.documents import Document, atomic_path, load, read_document, write_document
from robojoule.errors import CycleTimeTooShort, InputError


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


def test_where_nothing_can_be_written(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(InputError, match="the file cannot be written"):
        write_document(tmp_path / "file" / "out.json", {})


def test_cycle_time_message():
    error = CycleTimeTooShort(4.1, 4.36)
    assert (error.requested_s, error.minimum_s) == (4.1, 4.36)
    assert str(error) == "the cycle time 4.1 s is shorter than the fastest cycle; allowed: at least 4.360000 s"
