"""`robojoule robots`: the catalog."""

import json

from robojoule.cli import main


def test_robots_lists_the_catalog(capsys):
    assert main(["robots", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["robots"]
    assert "kuka_kr16_r2010_2" in [row["name"] for row in rows]
    assert main(["robots"]) == 0
    assert "kuka_kr16_r2010_2" in capsys.readouterr().out
