import json
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.report.gallery import ENTRIES
from reproduction.report.merge import merged_metrics
from reproduction.report.page import report_html
from robojoule.errors import InputError
from stages.draw_figures import draw_figures
from tests.core_cases import kr16
from tests.reproduction.report import toy

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def params() -> Params:
    return load_params(ROOT / "params.yaml")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory, params: Params) -> Layout:
    layout = Layout(tmp_path_factory.mktemp("drawn"))
    toy.make(layout.root, kr16())
    layout.figures_dir.mkdir(parents=True)
    (layout.figures_dir / "of_an_older_version.svg").write_text("<svg/>", encoding="utf-8")
    draw_figures(params, layout)
    return layout


def outputs(layout: Layout) -> dict[str, bytes]:
    files = [*layout.figures_dir.iterdir(), layout.report, layout.metrics]
    return {path.relative_to(layout.root).as_posix(): path.read_bytes() for path in files}


def test_every_output_is_written(drawn: Layout):
    assert {path.name for path in drawn.figures_dir.iterdir()} == {f"{entry.name}.svg" for entry in ENTRIES}
    assert drawn.report.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert json.loads(drawn.metrics.read_text(encoding="utf-8"))["energy_model"]["idle_power_home_w"] == 430.5


def test_the_same_results_elsewhere_give_the_same_bytes(drawn: Layout):
    """The shared toy results were made and drawn in another folder."""
    pictures, results = toy.shared_pictures(), toy.results(toy.shared_root(), kr16())
    metrics = merged_metrics(results.layout.metrics_dir)
    again = {f"reports/figures/{picture.entry.name}.svg": picture.svg.encode() for picture in pictures}
    again["reports/index.html"] = report_html(results, pictures, metrics).encode()
    first = outputs(drawn)
    assert [name for name in again if first[name] != again[name]] == []


def test_a_missing_result_leaves_no_half_written_report(tmp_path: Path, params: Params):
    layout = Layout(tmp_path)
    toy.make(layout.root, kr16(), points=1)
    layout.plans.unlink()
    with pytest.raises(InputError, match=r"plans\.parquet"):
        draw_figures(params, layout)
    assert not layout.report.exists() and not layout.figures_dir.exists() and not layout.metrics.exists()


@pytest.mark.parametrize("column", ["krc_segments", "move", "prior_wait_s"])
@pytest.mark.parametrize("missing", [True, False])
def test_a_garbled_plan_is_named(tmp_path: Path, params: Params, column: str, missing: bool):
    layout = Layout(tmp_path)
    toy.make(layout.root, kr16(), points=1)
    plans = pq.read_table(layout.plans)
    others = plans.drop_columns([column])
    wrong = pa.array([1 if column == "move" else "x"] * len(plans))
    pq.write_table(others if missing else others.append_column(column, wrong), layout.plans)
    with pytest.raises(InputError, match=rf"plans\.parquet, {column}: "):
        draw_figures(params, layout)
    assert not layout.report.exists() and not layout.figures_dir.exists() and not layout.metrics.exists()


def test_an_unknown_colormap_is_bad_input(drawn: Layout, params: Params):
    style = params.draw_figures.model_copy(update={"colormap": "nope"})
    before = outputs(drawn)
    with pytest.raises(InputError, match=r"draw_figures\.colormap"):
        draw_figures(params.model_copy(update={"draw_figures": style}), drawn)
    assert outputs(drawn) == before
