"""Texts of vendors' files: byte for byte, and edits of them."""

import pytest

from robojoule.errors import InputError
from robojoule.formats.vendor.text import Edit, SourceText, Span, edited, lines_of, read_source, unified_diff


@pytest.mark.parametrize(
    "content",
    [
        b"PTP P1\r\nPTP P2\r\n",
        "\ufeffPTP P1 ;Gru\u00df".encode(),
        b"PTP P1 ;Gr\xfc\xdfe\r\n",
        b"a\x85b\x0cc\rd\n",
        b"",
    ],
)
def test_a_text_encoded_again_is_the_file(tmp_path, content):
    (tmp_path / "a.src").write_bytes(content)
    source = read_source(tmp_path / "a.src")
    assert source.encoded(source.text) == content


def test_lines_are_counted_as_editors_do():
    assert lines_of("a\x85b\u2028c\r\nd\re\n\nf") == ["a\x85b\u2028c\r\n", "d\r", "e\n", "\n", "f"]


def test_a_file_of_two_bytes_a_letter_is_refused(tmp_path):
    (tmp_path / "a.src").write_bytes("PTP".encode("utf-16"))
    with pytest.raises(InputError, match=r"a\.src: the file is not 8-bit text"):
        read_source(tmp_path / "a.src")


def test_edits_stand_where_they_belong():
    edits = [Edit(Span(4, 6), "42"), Edit(Span(0, 0), "first "), Edit(Span(6, 6), "!"), Edit(Span(6, 6), "?")]
    assert edited("PTP P1", edits) == "first PTP 42!?"


def test_edits_that_overlap_are_a_fault():
    with pytest.raises(ValueError, match="overlap at character 1"):
        edited("abc", [Edit(Span(0, 2), ""), Edit(Span(1, 3), "")])


def test_a_difference_is_shown_as_a_unified_diff(tmp_path):
    source = SourceText(tmp_path / "a.src", "one\r\ntwo\r\nthree")
    assert unified_diff([source], [source.text]) == ""
    shown = unified_diff([source], ["one\r\n2\r\nthree"]).splitlines()
    assert shown[2:] == ["@@ -1,3 +1,3 @@", " one", "-two", "+2", " three"]
