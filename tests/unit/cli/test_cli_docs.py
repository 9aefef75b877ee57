"""rtec docs: the list of pages, a page, a part of one, and the nearest topic to an unknown word."""

import json
from pathlib import Path

import pytest

from rtec.effects import LIBRARY

VERB = "docs"

DOCS = Path(__file__).parents[3] / "docs"


def test_every_page_is_listed_with_its_title_in_the_order_of_the_index(said):
    code, out, err = said()
    assert (code, err) == (0, "")
    names = [line.split()[0] for line in out.splitlines()[:-1]]
    assert set(names) == {path.stem for path in DOCS.glob("*.md")} - {"index"}
    assert names[0] == "tutorial"
    assert "How a diagnosis comes about" in next(line for line in out.splitlines() if line.startswith("diagnosis "))


def test_a_page_goes_into_a_pipe_as_it_stands(said):
    assert said("how-to") == (0, (DOCS / "how-to.md").read_text(encoding="utf-8"), "")
    assert said("how-to.md")[1] == said("How-To")[1]


def test_a_page_is_laid_out_on_a_terminal(said, monkeypatch):
    monkeypatch.setenv("PAGER", "cat")
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setattr("pydoc.pager", print)
    code, out, _ = said("backlash")
    assert code == 0
    assert "\x1b[" in out
    assert "###" not in out


def test_a_heading_shows_its_part_only(said):
    code, out, _ = said("study", "file")
    assert (code, out.splitlines()[0]) == (0, "## Study file")
    assert "\n## " not in out


@pytest.mark.parametrize("name", [effect.name for effect in LIBRARY])
def test_every_effect_has_its_card(said, name):
    code, out, _ = said(name)
    assert code == 0
    assert out.startswith(f"### `{name}`: ")


def test_a_command_leads_to_its_row_and_to_the_pages_that_show_it(said):
    code, out, _ = said("rtec iso230")
    assert (code, out.splitlines()[0]) == (0, "# rtec iso230")
    assert "- `positioning`: Positioning tests" in out
    assert "rtec blind new\\|measure" in said("blind")[1]
    assert "rtec blind new" not in said("blind", "measure")[1]


def test_an_unknown_topic_names_the_nearest_one(said):
    assert said("tutorix") == (2, "", "rtec: no topic 'tutorix'; did you mean 'tutorial'?\n")
    assert "did you mean 'measurement uncertainty'?" in said("uncertainty")[2]
    assert said("qqqq") == (2, "", "rtec: no topic 'qqqq'; 'rtec docs' lists the topics\n")


def test_documents_hold_the_topics_or_the_text(said):
    code, out, err = said("--json")
    assert (code, err, out.count("\n")) == (0, "", 1)
    (first, *_) = json.loads(out)["topics"]
    assert first == {"name": "tutorial", "title": "Tutorial", "path": str(DOCS / "tutorial.md")}
    found = json.loads(said("tutorial", "--json")[1])
    assert found == first | {"text": (DOCS / "tutorial.md").read_text(encoding="utf-8")}
