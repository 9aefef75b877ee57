"""Files: text, TOML and JSON read with limits and errors that name the place; results written whole or not at all."""

from rtec.io.destination import FIGURES, check_file, check_folder, report_folder
from rtec.io.json import json_text, parse_json, strict
from rtec.io.pages import pages_folder
from rtec.io.text import MAX_BYTES, brief, read_any_text, read_bytes, read_text, unreadable
from rtec.io.toml import Section, choice, parse_toml, read_toml
from rtec.io.whole_file import WholeFile, write_bytes, write_lines, write_text
from rtec.io.whole_folder import whole_folder

__all__ = [
    "FIGURES",
    "MAX_BYTES",
    "Section",
    "WholeFile",
    "brief",
    "check_file",
    "check_folder",
    "choice",
    "json_text",
    "pages_folder",
    "parse_json",
    "parse_toml",
    "read_any_text",
    "read_bytes",
    "read_text",
    "read_toml",
    "report_folder",
    "strict",
    "unreadable",
    "whole_folder",
    "write_bytes",
    "write_lines",
    "write_text",
]
