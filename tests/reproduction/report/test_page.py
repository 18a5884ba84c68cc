"""The page as a reader's browser and a screen reader take it: well-formed, linked, labelled, self-contained."""

import re
from html.parser import HTMLParser
from itertools import pairwise

import pytest

from reproduction.report.gallery import ENTRIES, Picture
from reproduction.report.merge import merged_metrics
from reproduction.report.page import inline, report_html
from reproduction.report.results import Results

VOID = {"meta", "link", "br", "img", "hr", "input"}


class Page(HTMLParser):
    """Elements of a document, with a check that every one that is opened is closed in turn."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attributes}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attributes}))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def all(self, *tags: str) -> list[dict[str, str]]:
        return [attributes for tag, attributes in self.elements if tag in tags]


@pytest.fixture
def html(toy_results: Results, pictures: dict[str, Picture]) -> str:
    metrics = merged_metrics(toy_results.layout.metrics_dir)
    return report_html(toy_results, list(pictures.values()), metrics)


@pytest.fixture
def page(html: str) -> Page:
    return Page(html)


def test_names_are_unique_and_links_lead_somewhere(page: Page):
    names = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(set(names)) == len(names)
    for _, attributes in page.elements:
        for key in ("href", "xlink:href"):
            target = attributes.get(key, "")
            if target.startswith("#"):
                assert target[1:] in names, target
        for target in re.findall(r"url\(#([^)]*)\)", " ".join(attributes.values())):
            assert target in names
        for key in ("aria-labelledby", "aria-describedby"):
            assert all(name in names for name in attributes.get(key, "").split())


def test_nothing_is_loaded_from_elsewhere(page: Page, html: str):
    for tag, attributes in page.elements:
        for key in ("src", "href", "xlink:href", "data", "srcset", "poster", "action"):
            value = attributes.get(key, "")
            assert value.startswith(("#", "data:")) or not value, f"{tag} {key}={value}"
    assert not {tag for tag, _ in page.elements} & {"script", "iframe", "object", "embed"}
    assert "@import" not in html and not re.search(r"url\((?!#)", html)


def test_it_can_be_read_aloud(page: Page):
    """Headings without gaps, labels at every picture, captions and headers at every table."""
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch(r"h[1-6]", tag)]
    assert levels.count(1) == 1 and levels[0] == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    labelled = [svg for svg in page.all("svg") if svg.get("role") == "img" and svg.get("aria-label")]
    assert len(labelled) == len(page.all("svg")) == len(ENTRIES)
    assert len(page.all("caption")) == len(page.all("table")) > 5
    assert all(header.get("scope") in ("col", "row") for header in page.all("th"))
    assert page.all("html")[0]["lang"] == "en"
    assert any(meta.get("name") == "viewport" for meta in page.all("meta"))


def test_every_figure_stands_in_the_contents(page: Page):
    targets = [attributes.get("href") for attributes in page.all("a")]
    assert all(f"#{entry.name}" in targets for entry in ENTRIES)


def test_claims_are_shown_as_text_with_their_verdict(page: Page, html: str):
    assert "More &lt;segments&gt; help &amp; save" in html
    text = " ".join(" ".join(page.texts).split())
    assert "-1.00 points ✗ not held" in text and "marked as not held" in text


def test_tables_stand_beside_the_published_ones(page: Page):
    text = " ".join(page.texts)
    for value in ("17.42", "32.04", "49.64", "132.72", "8689", "6388"):  # of the thesis's four tables
        assert value in text
    assert "KRC polynomial, 4 segments" in text and "proven optimum" in text


def test_the_energy_model_tells_where_its_misses_are_explained(page: Page):
    text = " ".join(" ".join(page.texts).split())
    explained = text.index("docs/energy-model.md")
    assert explained < text.index("The energy model against the published figures") < text.index("512.50")


def test_no_time_path_or_version(html: str, toy_root: object):
    assert str(toy_root) not in html
    assert not re.search(
        r"\b20(2[4-9]|[3-9]\d)-\d\d-\d\d|\d\d:\d\d:\d\d|[Mm]atplotlib (v|version)|matplotlib\.org", html
    )


def test_it_is_small(html: str):
    assert len(html.encode()) < 5_000_000


def test_pieces_of_a_picture_keep_together(pictures: dict[str, Picture]):
    svg = inline(pictures["figure_4_5"]).svg
    names = set(re.findall(r'\bid="([^"]*)"', svg))
    used = set(re.findall(r'(?:href="#|url\(#)([^")]*)', svg))
    assert used and used <= names and all(name.startswith("figure_4_5-") for name in names)
    assert svg.startswith("<svg ") and "width=" not in svg.partition(">")[0] and "viewBox" in svg.partition(">")[0]
