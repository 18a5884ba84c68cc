"""URDF files made to harm: entities that grow without end or stand for other files, elements nested without end."""

from pathlib import Path

import pytest

from robojoule.errors import InputError
from robojoule.robots.urdf_elements import read_xml

GROWING = "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))


@pytest.mark.parametrize(
    ("declared", "content", "message"),
    [
        ('<!ENTITY a "aaaaaaaaaa">' + GROWING, "&i;", "amplification"),
        (f'<!ENTITY a "{"a" * 100_000}">', "&a;" * 30_000, "amplification"),
        ('<!ENTITY a SYSTEM "file:///etc/passwd">', "&a;", "undefined entity"),
    ],
    ids=["grows", "repeats", "another file"],
)
def test_entities_that_harm_are_one_sentence(tmp_path: Path, declared: str, content: str, message: str):
    path = tmp_path / "arm.urdf"
    path.write_text(f'<!DOCTYPE robot [{declared}]><robot name="r">{content}</robot>', encoding="utf-8")
    with pytest.raises(InputError, match=r"arm.urdf: the file cannot be read") as caught:
        read_xml(path)
    assert message in str(caught.value) and str(caught.value).isprintable()


def test_elements_may_be_nested_without_end(tmp_path: Path):
    path = tmp_path / "arm.urdf"
    path.write_text('<robot name="r">' + "<a>" * 200_000 + "</a>" * 200_000 + "</robot>", encoding="utf-8")
    assert read_xml(path).tag == "robot"
