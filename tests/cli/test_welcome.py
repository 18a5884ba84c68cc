"""The first words of `robojoule`."""

import re
import shlex

from robojoule import cli


def test_without_arguments_it_says_how_to_start(capsys, tmp_path, monkeypatch):
    """And what it says works as printed."""
    monkeypatch.chdir(tmp_path)
    assert cli.main([]) == 0
    said = capsys.readouterr().out
    joined = re.sub(r"\\\n *", "", said)
    commands = re.findall(r"^  robojoule (.*?)(?:   .*)?$", joined, re.M)
    assert len(commands) == 4
    for command in commands[:3]:
        assert cli.main(shlex.split(command)) == 0, command
    assert (tmp_path / "slower.yaml").exists()
    assert (tmp_path / "saving.html").exists()
