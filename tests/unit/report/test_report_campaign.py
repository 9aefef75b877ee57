"""The report of a campaign: what it counts, where its cells lead, and that its commands repeat jobs."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest

from rtec.cli import main
from rtec.errors import ArgumentError
from rtec.report import campaign_tally
from rtec.report.campaign import sentence, write_campaign
from rtec.report.campaign_page import fill_page
from rtec.report.figures_sobol import sobol_figure
from rtec.verify.campaign.executors import Serial
from rtec.verify.campaign.plan import Requirement, read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.store import Store
from rtec.verify.safety.threats import THREATS, Threat
from tests.pages import XHTML, files_in, page_of, text_of

SVG, XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"


@pytest.fixture
def plan(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(
        'job = "tests.campaign_jobs:KIND"\nruns = 2\nby = ["fate"]\n[try]\nwait = "0 s"\nlevel = [0, 1, 2]\n'
        'fate = ["pass", "fail", "exempt", "idle", "raise", "never"]\n'
    )
    return replace(read_plan(str(file)), name="<mine>", requirements=(Requirement(id="SR-2", where={"level": (2,)}),))


def written(plan, folder, again="rtec campaign 'a & b.toml'"):
    folder.mkdir()
    with Store(":memory:") as store:
        found = run_campaign(plan, store, Serial())
        page = write_campaign(found, store, addresses_of(plan), folder, again=again)
    return found, page, page_of(page)


def table(tree, section):
    place = next(one for one in tree.iter(f"{XHTML}section") if one.get("id") == section)
    return [[text_of(cell) for cell in row] for row in place.iter(f"{XHTML}tr")]


def test_a_report_says_what_was_tried_what_took_effect_and_what_was_not_survived(plan, tmp_path):
    found, page, tree = written(plan, tmp_path / "out")
    assert sentence(found) == "6 of 18 jobs failed; combinations that never took effect: 1; jobs without a record: 6."
    totals = {row[0]: row[1] for row in table(tree, "results")}
    assert [totals[key] for key in ("took effect", "passed", "failed", "exempt", "not activated", "no record")] == [
        "18", "6", "6", "6", "6", "6"
    ]  # fmt: skip
    assert table(tree, "requirements")[1][:5] == ["SR-2", "6", "2", "2", "2"]
    rates = {row[0]: row[1:] for row in table(tree, "rates")}
    # R. G. Newcombe, Statistics in Medicine 17 (1998) 857, method 3: Wilson's interval of 0/6 ends at z^2/(n + z^2)
    assert rates["pass"][5] == f"0 to {1.96**2 / (6 + 1.96**2):.2g}"
    assert rates["pass"][4] == f"below {1 - 0.05 ** (1 / 6):.2g}"
    assert rates["idle"][:5] == ["0", "0", "0", "6", "–"]
    holes = next(one for one in tree.iter(f"{XHTML}section") if one.get("id") == "holes")
    assert "fate idle" in text_of(holes) and "ValueError: no luck" in text_of(holes)
    commands = [row[2] for row in table(tree, "failed")[1:]]
    assert all(command.startswith("rtec campaign 'a & b.toml' --job ") for command in commands)
    assert len(commands) == 6
    document = json.loads((page.parent / "result.json").read_text())
    assert (document["requirements"]["SR-2"]["failed"], document["threats"]) == (2, [])


def test_a_cell_of_the_map_leads_to_its_jobs(plan, tmp_path):
    _, page, tree = written(plan, tmp_path / "out")
    links = [one.get(f"{XLINK}href") for one in tree.iter(f"{SVG}a")]
    pages = {name for name in files_in(page.parent) if name.startswith("jobs/")}
    assert len(links) == 2 * 15 and {link.partition("#")[0] for link in links} == pages
    for link in links:
        file, _, anchor = link.partition("#")
        jobs = next(one for one in page_of(page.parent / file).iter(f"{XHTML}section") if one.get("id") == anchor)
        assert len(list(jobs.iter(f"{XHTML}code"))) == (0 if "raise" in file else 2)
    failed = page_of(page.parent / "jobs/002-fail.html")
    heads = [text_of(head) for head in failed.iter(f"{XHTML}h2")]
    assert heads == [f"fail, {level}: failed" for level in range(3)]
    tables = {"figures/map.svg", "figures/map.png", "jobs.csv", "jobs.xml", "result.json"}
    assert tables <= files_in(page.parent)
    own = ET.parse(page.parent / "figures/map.svg")  # noqa: S314 - our own
    assert next(own.iter(f"{SVG}a")).get(f"{XLINK}href").startswith("../jobs/")


def test_a_plan_of_one_combination_has_jobs_and_no_map(plan, tmp_path):
    single = plan.only(["pass", "level=1"])
    found, page, tree = written(single, tmp_path / "out")
    assert (
        sentence(found)
        == "None of 2 jobs that took effect failed: with 95 % confidence the rate of failures is below 0.78."
    )
    assert not list(tree.iter(f"{SVG}svg")) and "figures/map.svg" not in files_in(page.parent)
    assert len(list(page_of(page.parent / "jobs/001-all.html").iter(f"{XHTML}code"))) == 2


def test_sobol_indices_are_drawn_as_long_as_they_are(tmp_path):
    file = tmp_path / "ishigami.toml"
    drawn = "\n".join(f'{name} = {{ from = -3.14, to = 3.14, draw = "sobol" }}' for name in "xyz")
    file.write_text(f'job = "tests.campaign_jobs:ISHIGAMI"\nruns = 64\n[try]\n{drawn}\n')
    found, page, tree = written(read_plan(str(file)), tmp_path / "out")
    assert "figures/sobol-1.png" in files_in(page.parent) and len(list(tree.iter(f"{SVG}svg"))) == 1
    value = [one for one in found.sensitivity if one.of == "value"]
    figure = sobol_figure(value)
    axes = figure.axes[0]
    order = [label.get_text() for label in axes.get_yticklabels()]
    by_name = {one.parameter: one for one in value}
    assert order == sorted(by_name, key=lambda name: -by_name[name].total)
    first, total = ([bar.get_width() for bar in bars] for bars in axes.containers)
    assert (first, total) == ([by_name[name].first for name in order], [by_name[name].total for name in order])
    ends = [tuple(line.get_xdata()) for line in axes.lines]
    assert ends == [by_name[name].first_95 for name in order] + [by_name[name].total_95 for name in order]


def test_the_page_of_many_jobs_shows_some_and_says_where_the_others_are(plan, tmp_path):
    many = replace(plan.only(["pass", "level=1"]), runs=503)
    _, page, _ = written(many, tmp_path / "out")
    jobs = page_of(page.parent / "jobs/001-all.html")
    assert len(list(jobs.iter(f"{XHTML}code"))) == 500 and "3 more are in jobs.csv." in text_of(jobs)
    assert len((page.parent / "jobs.csv").read_text().splitlines()) == 504


def test_the_command_writes_a_report_of_faults_with_threats_and_repeats_its_jobs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(campaign_tally, "_MOST_PICTURES", 1)
    words = ["campaign", "safety", "--only", "pc-killed,threat=deletion,c,cutting", "--runs", "1", "--workers", "1"]
    assert main([*words, "-o", "out"]) == 0
    tree = page_of(tmp_path / "out" / "report.html")
    threats = {row[0]: row for row in table(tree, "threats")}
    assert set(threats) == {"threat", "deletion", "programs and power"}
    assert threats["deletion"][2] == Threat.DELETION.defence
    assert threats["deletion"][6] == f"0 of 10: below {1 - 0.05 ** (1 / 10):.2g}"
    assert "box: link lost" in threats["programs and power"][3]
    jobs = page_of(tmp_path / "out/jobs/011-pc-killed.html")
    pictures = [one for one in files_in(tmp_path / "out") if one.endswith(".svg") and one.startswith("jobs/")]
    assert len(pictures) == 1
    assert {one.replace(".svg", ".vcd") for one in pictures} <= files_in(tmp_path / "out")
    command = text_of(next(row for row in jobs.iter(f"{XHTML}tr") if row.get("id")).find(f".//{XHTML}code"))
    capsys.readouterr()
    assert main([*command.split()[1:], "-o", "job"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["as_stored"] is True and Path(document["report"]).exists()
    assert (tmp_path / "job/job.vcd").read_text().startswith("$version")
    shown = text_of(page_of(tmp_path / "job/report.html"))
    assert "PC killed: safe stop" in shown and command in shown
    assert main([*words, "-o", "out"]) == 2
    assert "--force" in capsys.readouterr().err


def test_every_threat_of_the_standard_is_met_by_a_defence_and_tried_by_a_fault():
    assert {one.value for one in Threat} == {
        "repetition", "deletion", "insertion", "resequencing", "corruption", "delay", "masquerade"
    }  # fmt: skip
    assert set(THREATS.values()) == set(Threat)


def test_a_page_keeps_its_words_and_gets_the_tables_that_it_has_places_for(plan, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# Mine\n\n<!-- rtec campaign <mine>: rates -->\nold\n<!-- end -->\n\nstays\n\n"
        "<!-- rtec campaign <mine>: results -->\n<!-- end -->\n"
        "<!-- rtec campaign other: rates -->\nkept\n<!-- end -->\n"
    )
    with Store(":memory:") as store:
        found, addresses = run_campaign(plan, store, Serial()), addresses_of(plan)
        assert fill_page(page, found, store, addresses) == ["rates", "results"]
        text = page.read_text()
        assert "old" not in text and "\nstays\n" in text and "\nkept\n" in text
        rows = [line.split(" | ")[:3] for line in text.splitlines() if line.startswith("| fail ")]
        assert rows == [["| fail", "6", "6"]]
        assert fill_page(page, found, store, addresses) and page.read_text() == text
        page.write_text("<!-- rtec campaign <mine>: threats -->\n<!-- end -->\n")
        with pytest.raises(ArgumentError, match="'threats' is no table of this plan; use results, rates"):
            fill_page(page, found, store, addresses)
        page.write_text("# Mine\n")
        with pytest.raises(ArgumentError, match="has no place for this plan"):
            fill_page(page, found, store, addresses)
