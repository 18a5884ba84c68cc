"""Draw the figures, merge the metrics, write the HTML report."""

from __future__ import annotations

import os

from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.parts import Parts
from reproduction.report.gallery import draw_in_parts, write_pictures
from reproduction.report.merge import headline, merged_metrics
from reproduction.report.page import report_html
from reproduction.report.results import Results
from robojoule.documents import write_document, write_text
from robojoule.plots.style import Style
from stages.cli import run, say


def draw_figures(params: Params, layout: Layout) -> None:
    """Draw every figure of the report from the results of the other stages."""
    progress = say("draw_figures")
    style = Style(params.draw_figures.width_in, params.draw_figures.dpi, params.draw_figures.colormap)
    shape = ThreeSegmentShape(**params.evaluate_plans.three_segment.model_dump())
    results = Results(layout, params.robot.robot(), shape)
    metrics = merged_metrics(layout.metrics_dir)
    pictures = draw_in_parts(results, style, Parts(workers=os.cpu_count() or 1))
    progress(f"{len(pictures)} figures")
    page = report_html(results, pictures, metrics)
    # Nothing is written before everything is drawn: a missing result leaves the last report as it was.
    write_pictures(pictures, layout.figures_dir)
    write_document(layout.metrics, metrics)
    write_document(layout.headline, headline(metrics))
    write_text(layout.report, page)


if __name__ == "__main__":
    run(draw_figures, load_params)
