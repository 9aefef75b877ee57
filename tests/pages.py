"""Pages of reports, read as trees."""

import re
import xml.etree.ElementTree as ET

XHTML = "{http://www.w3.org/1999/xhtml}"


def page_of(path):
    """Return the page as a tree; that it can be read as XML says that every tag is closed."""
    return ET.fromstring(path.read_text("utf-8").removeprefix("<!DOCTYPE html>"))  # noqa: S314 - our own page


def text_of(element):
    return " ".join("".join(element.itertext()).split())


def files_in(place):
    return {path.relative_to(place).as_posix() for path in place.rglob("*") if path.is_file()}


def needs_nothing_else(page, pictures):
    """Hold a page to this: so many pictures in it, no script, and links to all files beside it and to none else."""
    tree, files = page_of(page), files_in(page.parent)
    sources = [element.get("src") for element in tree.iter() if element.get("src")]
    assert len(sources) == pictures and all(one.startswith("data:image/svg+xml;base64,") for one in sources)
    assert not list(tree.iter(f"{XHTML}script")) and not list(tree.iter(f"{XHTML}link"))
    links = {element.get("href") for element in tree.iter(f"{XHTML}a")}
    ids = [element.get("id") for element in tree.iter() if element.get("id")]
    assert links <= files | {f"#{name}" for name in ids} and files - links == {"report.html"}
    assert not re.search(r"url\(|@import|https?://(?!www\.w3\.org/1999/xhtml)", page.read_text("utf-8"))
    assert len(ids) == len(set(ids))
