"""Draw the figures, merge claims and metrics, write the HTML report."""

from __future__ import annotations

from reproduction.claims.claim import CLAIM_COLUMNS
from reproduction.config import Params
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.report.gallery import Picture, draw_all
from reproduction.report.merge import merged_claims, merged_metrics
from reproduction.report.page import report_html
from reproduction.report.results import ResultFiles, Results
from reproduction.tables import write_csv
from robojoule.documents import write_document, write_text
from robojoule.plots.style import Style
from stages._cli import run
from stages.layout import Layout


def draw_figures(params: Params, layout: Layout) -> None:
    """Draw every figure of the report from the results of the other stages."""
    style = Style(params.draw_figures.width_in, params.draw_figures.dpi, params.draw_figures.colormap)
    shape = params.evaluate_plans.three_segment
    results = Results(
        ResultFiles(layout.data_dir, layout.tables_dir, layout.metrics_dir, layout.studies_dir),
        params.robot.robot(),
        ThreeSegmentShape(shape.left_fraction, shape.right_fraction, shape.offset_j),
    )
    claims, metrics = merged_claims(results), merged_metrics(layout.metrics_dir)
    pictures: list[Picture] = []
    for picture in draw_all(results, style):
        pictures.append(picture)
        print(f"draw_figures: {picture.entry.name}", flush=True)
    page = report_html(results, pictures, claims, metrics)
    # Nothing is written before everything is drawn: a missing result leaves the last report as it was.
    layout.figures_dir.mkdir(parents=True, exist_ok=True)
    names = {f"{picture.entry.name}.svg" for picture in pictures}
    for stale in layout.figures_dir.glob("*.svg"):
        if stale.name not in names:
            stale.unlink()
    for picture in pictures:
        write_text(layout.figures_dir / f"{picture.entry.name}.svg", picture.svg)
    write_csv(layout.tables_dir / "claims.csv", claims, CLAIM_COLUMNS)
    write_document(layout.metrics, metrics)
    write_text(layout.report, page)


def main() -> None:
    """Run the stage from the command line."""
    run(draw_figures)


if __name__ == "__main__":
    main()
