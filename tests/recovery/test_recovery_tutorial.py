"""The tutorial of the diagnosis: its commands print what it shows, and its pictures are what they draw."""

from pathlib import Path

import pytest

from tests.consoles import carried_out, differences, steps_of

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "tutorial-diagnosis.md"
"""Bytes of a picture on a page."""


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Return the commands of the page with what each printed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("tutorial"))
        patch.setenv("COLUMNS", "100")
        return carried_out(PAGE.read_text(encoding="utf-8"))


def test_commands_print_what_the_page_shows(printed):
    assert differences(printed) == [], "python -m tests.consoles docs/tutorial-diagnosis.md writes them anew"
    assert sum(len(step.shown) for step, _ in printed) > 25


def test_the_readme_shows_the_same(printed):
    lines = {tuple(step.words): lines for step, lines in printed}
    steps = steps_of((ROOT / "README.md").read_text(encoding="utf-8"))
    same = [(step, lines[tuple(step.words)]) for step in steps if tuple(step.words) in lines]
    assert len(same) == 3
    assert differences(same) == [], "python -m tests.consoles README.md writes them anew"
