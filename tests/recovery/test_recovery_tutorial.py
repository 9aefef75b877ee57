"""The tutorial of the diagnosis: its commands print what it shows, and its pictures are what they draw."""

import re
import shlex
from pathlib import Path

import pytest

from rtec.cli import main

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "tutorial-diagnosis.md"
FENCE = re.compile(r"^```(?P<kind>[^\n]*)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL)
SMALL = 200_000
"""Bytes of a picture on a page."""


def fences(kind):
    return [match for match in FENCE.finditer(PAGE.read_text(encoding="utf-8")) if match["kind"].startswith(kind)]


def commands():
    """Return the words of each command with the lines shown under it."""
    found = []
    for fence in fences("console"):
        for part in re.split(r"^\$ rtec ", fence["body"], flags=re.MULTILINE)[1:]:
            first, *shown = part.splitlines()
            found.append((shlex.split(first), [line for line in shown if line != "..."]))
    return found


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What each command printed, in a folder with the page's file."""
    folder = tmp_path_factory.mktemp("tutorial")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "100")
        for fence in fences("file "):
            Path(fence["kind"].split()[1]).write_text(fence["body"], encoding="utf-8")
        yield folder


def squeezed(text):
    return [" ".join(line.split()) for line in text.splitlines()]


def test_commands_print_what_the_page_shows(printed, capsys):
    shown = 0
    for words, expected in commands():
        assert main(words) == 0, words
        out, err = capsys.readouterr()
        lines = iter(squeezed(out + err))
        for line in expected:
            assert " ".join(line.split()) in lines, (words, line)  # in this order
            shown += 1
    assert shown > 25


def test_pictures_are_there_and_small():
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+\.png)\)", PAGE.read_text(encoding="utf-8"))
    assert len(pictures) == 4
    for picture in pictures:
        content = (PAGE.parent / picture).read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) < SMALL
