"""The report of a positioning test: its folder, its plot, its page and its PDF."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.metrology import (
    JudgedTest,
    Readings,
    UncertaintyInputs,
    positioning_figures,
    positioning_uncertainty,
    vdi_figures,
)
from rtec.metrology.readings import RotaryReadings
from rtec.report.figures_style import figure_style, new_figure
from rtec.report.iso230.figures import draw_tests
from rtec.report.iso230.folder import write_positioning
from rtec.report.iso230.pdf import sheet_pages
from rtec.report.iso230.sheet import sheet_of

HOSTILE = "<script>alert('x')</script> & $\\frac{ 軸"
PLACES = np.array([0.0, 80.0, 170.0, 300.0, 410.0, 550.0])


def judged(name="x.csv", *, size_mm=0.02, runs=5, ways=(1, -1), rotary=False, inputs=None, warnings=()):
    """Return a test whose largest errors stand at the third and the last target."""
    rng = np.random.default_rng(4)
    target = np.tile(np.concatenate([PLACES[::way] for way in ways]), runs)
    direction = np.tile(np.repeat(ways, PLACES.size), runs)
    deviation = size_mm * (np.sin(target / 100.0) - 0.3 * direction + 0.05 * rng.normal(size=target.size))
    run = np.repeat(np.arange(1, runs + 1), PLACES.size * len(ways))
    if rotary:
        readings = RotaryReadings(target_deg=target / 2, deviation_deg=deviation / 10, direction=direction, run=run)
    else:
        readings = Readings(target_mm=target, deviation_mm=deviation, direction=direction, run=run)
    figures = positioning_figures(readings)
    return JudgedTest(
        name=name,
        facts={"machine": f"lathe {HOSTILE}"},
        figures=figures,
        vdi=vdi_figures(figures),
        uncertainty=positioning_uncertainty(figures, inputs or UncertaintyInputs()),
        warnings=tuple(warnings),
        unknown=(),
    )


def drawn(*tests, unit=None):
    """Return the panels of the plot."""
    with figure_style():
        figure = new_figure(4.0)
        sheet = sheet_of(tests, unit)
        draw_tests(figure, sheet.tests, sheet.units, sheet.table.decimals)
    return figure.axes


def dimensions(axes):
    """Return the lengths of the arrows of a panel, ascending."""
    arrows = [text for text in axes.texts if getattr(text, "arrow_patch", None) is not None]
    return sorted(abs(arrow.xy[1] - arrow.xyann[1]) for arrow in arrows)


def words(axes):
    return [text.get_text() for text in axes.texts if text.get_text()]


@pytest.mark.parametrize("unit", ["um", "mm", "nm", "inch"])
def test_dimension_arrows_are_as_long_as_the_figures(unit):
    test = judged()
    (axes,) = drawn(test, unit=unit)
    document = test.to_dict(unit)
    assert dimensions(axes) == pytest.approx(sorted(document[key] for key in "AEMRB"), rel=1e-9)
    digits = sheet_of([test], unit).table.decimals
    beside = {f"{key}\n{document[key]:.{digits}f}" for key in "AEM"}
    assert set(words(axes)) == beside | {f"{key} {document[key]:.{digits}f}" for key in "RB"}


def test_one_direction_has_its_own_dimensions():
    test = judged(ways=(-1,))
    (axes,) = drawn(test)
    document = test.to_dict()
    expected = [document[f"{key}_backward"] for key in "AER"]
    assert dimensions(axes) == pytest.approx(sorted(expected), rel=1e-9)
    assert {text[:2] for text in words(axes)} == {"A↓", "E↓", "R↓"}


def page_of(folder):
    """Return the page as a tree; that it can be read as XML says that every tag is closed."""
    text = (folder / "report.html").read_text("utf-8")
    return ET.fromstring(text.removeprefix("<!DOCTYPE html>").strip()), text  # noqa: S314 - our own page


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Return two tests, and the folder of their report."""
    tests = judged("before.csv"), judged("after.csv", size_mm=0.002, warnings=["line 7: odd"])
    folder = tmp_path_factory.mktemp("report")
    assert write_positioning(sheet_of(tests, None), folder) == folder / "report.html"
    return tests, folder


def test_folder_holds_page_pdf_plot_and_numbers(written):
    tests, tmp_path = written
    files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    figures = {"figures/positioning.svg", "figures/positioning.png"}
    assert files == {"report.html", "report.pdf", "result.json", *figures}
    assert json.loads((tmp_path / "result.json").read_text()) == {
        "files": [{"name": test.name} | test.to_dict() for test in tests]
    }
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF-")
    page, text = page_of(tmp_path)
    said = " ".join("".join(page.itertext()).split())
    for part in ("before.csv", "after.csv", "line 7: odd", "VDI/DGQ 3441", "No measurement uncertainty"):
        assert part in said
    assert not re.search(r"(?:src|href)=\"(?!data:|#|report\.|result\.|figures/)", text)


def test_same_tests_give_the_same_bytes(written, tmp_path):
    tests, folder = written
    write_positioning(sheet_of(tests, None), tmp_path)
    for file in ("report.html", "report.pdf"):
        assert (tmp_path / file).read_bytes() == (folder / file).read_bytes()


def test_uncertainty_stands_in_table_and_sentence(tmp_path):
    test = judged(inputs=UncertaintyInputs(device_uncertainty=1e-6, eve=0.001))
    write_positioning(sheet_of([test], None), tmp_path)
    page, _ = page_of(tmp_path)
    said = " ".join("".join(page.itertext()).split())
    u = test.to_dict()["uncertainty"]
    assert f"U(A) {u['U_A']:.2g} µm" in said
    assert "device 0.55 µm" in said  # 1 um/m on 550 mm
    assert "Not included, because not stated: alignment (misalignment)" in said
    row = next(row for row in sheet_of([test], None).table.groups[0].rows if row.symbol == "B")
    assert row.cells[-1] == f"{u['U_B']:.1f}"


def text_of(pages):
    return [text.get_text() for page in pages for text in page.texts]


def test_pages_of_the_pdf_hold_everything():
    tests = [judged(f"axis {number}", warnings=["odd"]) for number in range(1, 6)]
    with figure_style():
        pages = sheet_pages(sheet_of(tests, None))
        texts = text_of(pages)
        for page in pages:
            page.draw_without_rendering()
            bottom = min(text.get_window_extent().y0 for text in page.texts)
            assert bottom >= 0
    panels = [axes.get_title(loc="left") for page in pages for sub in walk(page) for axes in sub.axes]
    assert sorted(set(panels)) == [test.name for test in tests]
    assert texts.count(f"{PLACES[-1]:g}") == 5  # the last target of each test
    assert sum(text.endswith(": odd") for text in texts) == 5
    assert "What the figures mean" in texts


def walk(figure):
    """Return a figure and all that it is divided into."""
    return [figure, *(part for sub in figure.subfigs for part in walk(sub))]


def test_tables_go_on_over_pages():
    rng = np.random.default_rng(0)
    target = np.arange(150.0)
    figures = positioning_figures(
        Readings(
            target_mm=np.tile(np.concatenate((target, target)), 2), deviation_mm=rng.normal(size=600),
            direction=np.tile(np.repeat([1, -1], 150), 2), run=np.repeat([1, 2], 300),
        )
    )  # fmt: skip
    long = JudgedTest(
        name="long", facts={}, figures=figures, vdi=None, warnings=(), unknown=(),
        uncertainty=positioning_uncertainty(figures, UncertaintyInputs()),
    )  # fmt: skip
    with figure_style():
        texts = text_of(sheet_pages(sheet_of([long], None)))
    assert [text for text in texts if text in ("0", "149")] == ["0", "149"]
    assert texts.count("mean ↑") >= 3  # the headings again on each page


def test_unit_of_another_kind_of_axis_is_refused(tmp_path):
    with pytest.raises(ArgumentError, match="arcsec, deg, urad"):
        write_positioning(sheet_of([judged(rotary=True)], "um"), tmp_path)
    assert list(tmp_path.iterdir()) == []
