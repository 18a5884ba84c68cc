"""Arrays of a predictor: what is written is read; files made to harm are one sentence, and run nothing."""

import io
import os
import pickle
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.profile.array_file import read_arrays, write_arrays


class Bomb:
    """Makes a file when it is unpickled."""

    def __init__(self, place: Path) -> None:
        self.place = place

    def __reduce__(self):
        return os.mkdir, (str(self.place),)


def array(shape: str, kind: str = "'<f8'", content: bytes = b"") -> bytes:
    """An array file of a header that claims what it likes."""
    text = f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + content


def archive(content: bytes, packed: int = zipfile.ZIP_STORED, **changes: int) -> bytes:
    """A ZIP archive with one array; changes are made to its headers afterwards."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", packed) as stored:
        stored.writestr("a.npy", content)
    found = bytearray(file.getvalue())
    directory = found.index(b"PK\x01\x02")
    for name, value in changes.items():
        for place in {"flags": (6, directory + 8), "method": (8, directory + 10)}[name]:
            found[place : place + 2] = struct.pack("<H", value)
    return bytes(found)


def test_what_is_written_is_read(tmp_path: Path):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([7])}
    write_arrays(tmp_path / "x.npz", arrays)
    found = read_arrays(tmp_path / "x.npz", lambda read: read)
    assert {name: one.tolist() for name, one in found.items()} == {name: one.tolist() for name, one in arrays.items()}


HOSTILE = {
    "pickle": (lambda bomb: pickle.dumps(bomb), "not a zip file"),
    "objects": (lambda bomb: archive(array("(1,)", "'|O'", pickle.dumps(np.array([bomb])))), "Object arrays cannot be"),
    "array alone": (lambda _: array("(1,)", content=bytes(8)), "not a zip file"),
    "more than there is": (lambda _: archive(array("(1000000000000000,)")), "larger than"),
    "cut off": (lambda _: archive(array("(9,)", content=bytes(8))), "EOF"),
    "negative": (lambda _: archive(array("(-5,)")), "negative dimensions"),
    "nested header": (lambda _: archive(b"\x93NUMPY\x01\x00" + struct.pack("<H", 9000) + b"(" * 9000), "EOF"),
    "unpacks to much": (lambda _: archive(array("(9,)", content=bytes(2**24)), zipfile.ZIP_DEFLATED), "compressed"),
    "unknown method": (lambda _: archive(array("(1,)", content=bytes(8)), method=99), "compression method"),
    "encrypted": (lambda _: archive(array("(1,)", content=bytes(8)), flags=1), "encrypted"),
    "texts": (lambda _: archive(array("(1,)", "'<U2'", bytes(8))), "does not hold a predictor"),
    "not a number": (lambda _: archive(array("(1,)", content=struct.pack("<d", np.nan))), "not finite numbers"),
}


@pytest.mark.parametrize(("make", "message"), HOSTILE.values(), ids=HOSTILE.keys())
def test_files_made_to_harm_are_one_sentence(tmp_path: Path, make, message: str):
    (tmp_path / "x.npz").write_bytes(make(Bomb(tmp_path / "harmed")))
    with pytest.raises(InputError, match="does not hold a predictor") as caught:
        read_arrays(tmp_path / "x.npz", lambda read: read)
    assert message in str(caught.value) and str(caught.value).isprintable()
    assert not (tmp_path / "harmed").exists()


def test_the_bomb_would_go_off(tmp_path: Path):
    """Else the test above would show nothing."""
    pickle.loads(pickle.dumps(Bomb(tmp_path / "harmed")))
    assert (tmp_path / "harmed").exists()
