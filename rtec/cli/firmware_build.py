"""``rtec firmware copy`` and ``rtec firmware build``: a firmware of one's own, from a copy to an image."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Annotated

import typer

from rtec.cli import _measured
from rtec.cli._console import print_json
from rtec.cli._parameters import choice, force, option
from rtec.cli._words import among
from rtec.errors import OutputError, RtecError
from rtec.io import check_file

_INCLUDES = {
    "8051-12mhz": "8051",
    "8051-24mhz": "8051",
    "one-clock-25mhz": "one_clock_25mhz",
    "one-clock-100mhz": "one_clock_100mhz",
}
"""What a source includes as processor.inc."""
_OUTPUTS = (".ihx", ".lst", ".sym")


def copy(
    design: Annotated[
        str,
        typer.Argument(
            metavar="original|a|b|c",
            help="What to begin with.",
            show_default=False,
            autocompletion=among("original|a|b|c"),
        ),
    ],
    file: Annotated[Path, typer.Argument(metavar="MINE.asm", help="Your source.", show_default=False)],
    force: Annotated[bool, force("Write over a file that exists.")] = False,
    json: _measured.Json = False,
) -> None:
    """Copy the source of a design that comes with this package, as a beginning of your own.

    Example: rtec firmware copy c mine.asm
    Example: rtec firmware copy original mine.asm --force
    Example: rtec firmware copy b mine.asm && rtec firmware build mine.asm
    """
    from importlib.resources import files

    from rtec.injector import Design
    from rtec.io import write_bytes

    name = Design.named(design).value
    check_file("MINE.asm", file, force=force, endings=(".asm",))
    source = (files("firmware_model") / "images" / f"{name}.asm").read_bytes()
    write_bytes(file, source)
    if json:
        print_json({"source": str(file), "design": name})
    else:
        typer.echo(f"{file}: design {name}")


def build(
    source: Annotated[Path, typer.Argument(metavar="MINE.asm", help="Your source.", show_default=False)],
    processor: Annotated[
        str,
        option(
            "--processor",
            "NAME",
            f"What processor.inc stands for: {', '.join(_INCLUDES)}.",
            read=lambda said: choice(said, _INCLUDES, name="--processor"),
        ),
    ] = "8051-12mhz",
    json: _measured.Json = False,
) -> None:
    """Assemble a source with SDCC: MINE.ihx, the listing MINE.lst and the labels MINE.sym beside MINE.asm.

    The shared parts of this package (rtec.inc, common.asm, ...) are there under their bare names; files of the same
    name beside the source take their place.

    Example: rtec firmware build mine.asm
    Example: rtec firmware build mine.asm --processor one-clock-25mhz
    Example: rtec firmware build mine.asm --json
    """
    from firmware_model.images.build import BuildError, assemble
    from rtec.io import write_text

    include = _INCLUDES[processor]
    for suffix in _OUTPUTS if source.is_file() else ():
        check_file("MINE.asm", source.with_suffix(suffix), force=True)
    try:
        outputs = assemble(source, include)
    except (BuildError, subprocess.TimeoutExpired) as error:
        raise RtecError(str(error)) from error
    except UnicodeDecodeError as error:
        raise OutputError(f"{source}: the assembler's output is no text: {error}") from error
    written = []
    for suffix, text in outputs.items():
        file = source.with_suffix(suffix)
        write_text(file, text)
        written.append(str(file))
    if json:
        print_json({"source": str(source), "processor": processor, "written": written})
    else:
        typer.echo(f"written: {', '.join(written)}")
