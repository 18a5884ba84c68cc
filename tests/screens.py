"""Pictures of the pages of Prefect and MLflow for docs/operations.md: `python -m tests.screens`.

The last commit runs as in a night, in a clone with servers of its own. A page is taken only when it shows the name of
the run and a figure that the run made.
"""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from PIL import Image
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from tests.browser import browser
from tests.conftest import free_port
from tests.servers import artifacts, ask
from tests.toy import ROOT

FIGURES = ROOT / "docs/figures"
LARGEST_BYTES = 150_000
PATIENCE_S = 120.0
METRIC = "predictors.energy_saving_j.random_forest.rel_p50_percent"


def wait_for_texts(window: Chrome, texts: list[str]) -> None:
    """Wait until a page shows all of some texts.

    Raises:
        AssertionError: It does not.
    """
    end = time.monotonic() + PATIENCE_S
    while missing := [text for text in texts if text not in window.find_element(By.TAG_NAME, "body").text]:
        assert time.monotonic() < end, f"{window.current_url} does not show {missing}"
        time.sleep(0.5)


def save(window: Chrome, path: Path) -> None:
    """Save what a window shows, in few colours."""
    picture = Image.open(io.BytesIO(window.get_screenshot_as_png())).convert("RGB")
    picture.quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)
    assert path.stat().st_size < LARGEST_BYTES, f"{path} has {path.stat().st_size} bytes"


def take_prefect(prefect: str, project: Path, folder: Path) -> None:
    """The table of savings, as the newest finished run of the pipeline published it.

    Args:
        prefect: Address of the server.
        project: Folder of the results that the run made.
        folder: Where the picture goes, as prefect.png.
    """
    artifact = artifacts(f"{prefect}/api", "table-6-1")[0]
    (run,) = ask(f"{prefect}/api", "flow_runs/filter", {"flow_runs": {"id": {"any_": [artifact["flow_run_id"]]}}})
    assert run["state"]["type"] == "COMPLETED"
    with (project / "reports/tables/table_6_1.csv").open(newline="", encoding="utf-8") as file:
        saving = next(csv.DictReader(file))["saving_percent"]
    with browser(1400, 860) as window:
        window.get(f"{prefect}/artifacts/artifact/{artifact['id']}")
        wait_for_texts(window, [run["name"], "Table 6.1", saving])
        save(window, folder / "prefect.png")


def take_mlflow(mlflow: str, project: Path, folder: Path) -> None:
    """The newest training of the forest, with its figures.

    Args:
        mlflow: Address of the server.
        project: Folder of the results that the training made.
        folder: Where the picture goes, as mlflow.png.
    """
    api = f"{mlflow}/api/2.0/mlflow"
    found = ask(api, "experiments/search", {"max_results": 100, "filter": "name = 'pipeline'"})["experiments"]
    wanted = {"experiment_ids": [found[0]["experiment_id"]], "filter": "tags.model = 'random_forest'"}
    (run,) = ask(api, "runs/search", {**wanted, "max_results": 1, "order_by": ["start_time DESC"]})["runs"]
    value: Any = json.loads((project / "reports/metrics.json").read_text(encoding="utf-8"))
    for key in METRIC.split("."):
        value = value[key]
    with browser(1500, 940) as window:
        window.get(mlflow)
        for name, value_of in (("fab.autoOpenedOnFirstLoad", "true"), ("panelOpen", "false")):
            window.execute_script(f"localStorage.setItem('mlflow.assistant.{name}_v1', '{value_of}')")
        window.get("about:blank")  # else the page stays as it is
        window.get(f"{mlflow}/#/experiments/{found[0]['experiment_id']}/runs/{run['info']['run_id']}")
        wait_for_texts(window, [run["info"]["run_name"], "Finished", METRIC, str(value)])
        save(window, folder / "mlflow.png")


def main() -> None:
    """Bring up a desk in a clone of the last commit, run a night, take both pages."""
    desk = [sys.executable, "-m", "flows.desk"]
    with tempfile.TemporaryDirectory(prefix="screens-") as name:
        project = Path(name) / "robojoule"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(project)], check=True)
        subprocess.run(["git", "checkout", "-q", "-B", "main"], cwd=project, check=True)  # MLflow shows the branch
        cache = [sys.executable, "-m", "dvc", "cache", "dir"]
        place = subprocess.run(cache, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
        (project / ".dvc/config.local").write_text(f"[cache]\n    dir = {place}\n", encoding="utf-8")
        ports = ("PREFECT_SERVER_API_PORT", "PREFECT_WORKER_WEBSERVER_PORT", "MLFLOW_PORT")
        os.environ.update({name: str(free_port()) for name in ports} | {"LOGNAME": "robojoule"})  # it shows the user
        prefect, mlflow = (f"http://127.0.0.1:{os.environ[name]}" for name in (ports[0], ports[2]))
        night = ["prefect", "deployment", "run", "--watch", "pipeline-nightly/pipeline-nightly"]
        try:
            subprocess.run([*desk, "up"], cwd=project, check=True)
            subprocess.run(
                [sys.executable, "-m", *night],
                cwd=project,
                env={**os.environ, "PREFECT_API_URL": f"{prefect}/api"},
                check=True,
            )
            take_prefect(prefect, project, FIGURES)
            take_mlflow(mlflow, project, FIGURES)
        finally:
            subprocess.run([*desk, "down"], cwd=project, check=True)


if __name__ == "__main__":
    main()
