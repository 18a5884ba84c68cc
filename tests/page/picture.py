"""The picture of a page for README and docs: `python -m tests.page.picture` makes it again from the example."""

import tempfile
from pathlib import Path

import robojoule as rj
from tests.browser import browser
from tests.screens import FIGURES, save


def main() -> None:
    """Draw what README's commands write."""
    program = rj.load_program(Path(rj.__file__).parent / "examples" / "cycle.yaml")
    robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
    page = rj.report(rj.optimize(program, robot, cycle_time="+10%"), program, robot)
    with tempfile.TemporaryDirectory() as folder, browser(1000, 1290) as window:
        path = Path(folder) / "page.html"
        page.save(path)
        window.get(path.as_uri())
        save(window, FIGURES / "page.png")


if __name__ == "__main__":
    main()
