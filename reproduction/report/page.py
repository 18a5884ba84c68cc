"""The HTML report: one file with figures, tables and claims in it, nothing loaded from elsewhere."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from reproduction.report import tables
from reproduction.report.gallery import Picture
from reproduction.report.labels import KNOWN_PLANT
from reproduction.report.results import Results
from reproduction.report.summary import summary_of
from robojoule.documents import read_document

TEMPLATE = "page.html.j2"
REASONS = Path(__file__).with_name(
    "why_claims_fail.yaml"
)  # of the thesis's robot; another's claims fail for reasons of its own


@dataclass(frozen=True)
class Inline:
    """A picture inside the page.

    Attributes:
        anchor: Its name in links.
        heading: Title with the figure's number.
        svg: SVG element.
        caption: What it shows.
    """

    anchor: str
    heading: str
    svg: str
    caption: str


def report_html(results: Results, pictures: Sequence[Picture], metrics: dict[str, Any]) -> str:
    """Build the page.

    Args:
        results: Results of the stages.
        pictures: Figures, in the order of their chapters.
        metrics: Merged metrics.

    Returns:
        An HTML document that holds no time, path or version and loads nothing.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(__name__.rpartition(".")[0], ""),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    chapters = [
        (chapter, [inline(picture) for picture in group])
        for chapter, group in groupby(pictures, key=lambda picture: picture.entry.chapter)
    ]
    claims = results.table("claims") or []
    judged = [row for row in claims if row["held"]]
    return environment.get_template(TEMPLATE).render(
        chapters=chapters,
        summary=summary_of(results),
        claims=claims,
        reasons=reasons_of(results.robot.name),
        held=sum(row["held"] == "true" for row in judged),
        judged=len(judged),
        robot=results.robot.name,
        payload_kg=results.robot.payload.mass_kg,
        table_6_1=tables.table_6_1(results, f"{results.plan_bound} {KNOWN_PLANT}"),
        difference=tables.difference(results),
        table_5_1=tables.table_5_1(results),
        gaps=[
            *([tables.gap_table(rows, "Experiment trees")] if (rows := results.table("gaps")) else []),
            *([tables.win_table(rows, "Experiment trees")] if (rows := results.table("wins")) else []),
        ],
        known_plant=KNOWN_PLANT,
        plan_bound=results.plan_bound,
        studies=tables.study_tables(results),
        table_6_2=_with_published(results, "table_6_2", "cycle times of 110, 121 and 133 %"),
        table_6_3=_with_published(results, "table_6_3", "cycle times of 150, 175 and 200 %"),
        energy_model=tables.plain(results, "energy_model", "The energy model against the published figures"),
        more=[
            table
            for table in (
                tables.plain(results, "retrace", "Forward and reverse profiles of the same paths compared"),
                tables.plain(results, "payload_sensitivity", "Sensitivity to the payload"),
                tables.plain(results, "suitability", "How well the order of suitability is predicted"),
            )
            if table
        ],
        metrics=tables.metrics_table(metrics) if metrics else None,
    )


def reasons_of(robot: str) -> dict[str, str]:
    """Why claims do not hold, by claim; none for a robot other than the thesis's."""
    known = read_document(REASONS)
    return dict(known["reasons"]) if known["robot"] == robot else {}


def _with_published(results: Results, name: str, what: str) -> list[tables.Table]:
    number = name.removeprefix("table_").replace("_", ".")
    obtained = tables.plain(results, name, f"Table {number} as obtained, {what} [J]")
    return [
        *([obtained] if obtained else []),
        tables.published_plain(name, f"Table {number} of the thesis, {what} [J]"),
    ]


def inline(picture: Picture) -> Inline:
    """Make a stand-alone SVG part of a page: names that are unique in it, a label, no fixed size.

    Args:
        picture: Drawn figure.
    """
    name = picture.entry.name
    svg = picture.svg[picture.svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r"url\(#", f"url(#{name}-", svg)
    svg = re.sub(r'href="#', f'href="#{name}-', svg)
    head, _, body = svg.partition(">")
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head)
    label = picture.alt.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    number = picture.entry.number
    heading = f"Figure {number}: {picture.entry.title}" if number else picture.entry.title
    return Inline(name, heading, f'{head} role="img" aria-label="{label}">{body}', picture.caption)
