"""Assemble the box's firmware with SDCC's ``sdas8051`` and ``sdld``: NAME.ihx, NAME.lst and NAME.sym beside NAME.asm.

::

    python firmware_model/images/build.py                  the four designs of the report, for each processor
    python firmware_model/images/build.py --check          assemble again and compare with what is there
    python firmware_model/images/build.py PATH/mine.asm    an image of your own, with the shared parts at hand
    python firmware_model/images/build.py PATH/mine.asm --processor one_clock_100mhz
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
DESIGNS = ("original", "a", "b", "c")
PROCESSORS = ("8051", "one_clock_25mhz", "one_clock_100mhz")
"""Files of the folder processors; what is of the first stands beside the sources, of the others in a folder each."""
SHARED = ("rtec.inc", "common.asm", "seek_xor.asm")
LONGEST_S = 60
_LABEL = re.compile(r"^\s*\d+\s+(?P<name>\S+)\s+(?P<address>[0-9A-F]{6})\s+\S*R\S*\s*$", re.MULTILINE)


class BuildError(Exception):
    """An image could not be assembled; the message says what to do."""


def tool(name: str) -> str:
    """Return the path of one of SDCC's programs.

    Raises
    ------
    BuildError
        It is not on the path.
    """
    found = shutil.which(name)
    if found is None:
        raise BuildError(
            f"{name}: not found on the path; the images are assembled with SDCC 4.2 (Debian and Ubuntu: "
            "apt-get install sdcc). The committed .ihx files run without it"
        )
    return found


def run_tool(folder: Path, *words: str) -> None:
    """Run one of the programs in ``folder``; its complaints become a BuildError."""
    command = [tool(words[0]), *words[1:]]
    done = subprocess.run(  # noqa: S603 - no shell, and the words are this module's own
        command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LONGEST_S, check=False
    )
    complaints = [line for line in (done.stdout + done.stderr).splitlines() if not line.startswith("ASlink >>")]
    if done.returncode != 0 or any("Error" in line or "Warning" in line for line in complaints):
        raise BuildError(f"{words[0]} {words[-1]}: exit code {done.returncode}\n" + "\n".join(complaints))


def symbols_of(table: str) -> str:
    """Return the labels of an assembler's symbol table, one "0xADDRESS NAME" a line, by address.

    Examples
    --------
    >>> table = ["  5 work      000249 R", "  5 tick      000051 R", "    TL0   = 00008A L"]
    >>> symbols_of(chr(10).join(table)).splitlines()
    ['0x0051 tick', '0x0249 work']
    """
    labels = sorted((int(match["address"], 16), match["name"]) for match in _LABEL.finditer(table))
    return "".join(f"0x{address:04X} {name}\n" for address, name in labels)


def assemble(source: Path, processor: str = PROCESSORS[0]) -> dict[str, str]:
    """Assemble one image in a temporary folder.

    Parameters
    ----------
    source
        The .asm file; it may include the shared parts by their bare names, and any file beside it.
    processor
        One of `PROCESSORS`: its include file is there as ``processor.inc``.

    Returns
    -------
    dict
        Text of each output by its suffix: Intel HEX, listing with addresses and cycles, labels.

    Raises
    ------
    BuildError
        The source is not there, SDCC is not installed, or it refuses the source.
    """
    if source.suffix != ".asm" or not source.is_file():
        raise BuildError(f"{source}: no such source; use the path of an .asm file")
    with tempfile.TemporaryDirectory(prefix="rtec-image-") as name:
        folder = Path(name)
        beside = [path for path in source.parent.iterdir() if path.suffix in (".asm", ".inc")]
        processors = sorted((HERE / "processors").glob("*.inc"))
        for path in [*(HERE / shared for shared in SHARED), *processors, *beside]:
            shutil.copyfile(path, folder / path.name)
        shutil.copyfile(folder / f"{processor}.inc", folder / "processor.inc")
        run_tool(folder, "sdas8051", "-plosgffw", source.name)
        # "name.ihx" first: the linker names its output, and the listing with final addresses, after it
        run_tool(folder, "sdld", "-i", "-u", f"{source.stem}.ihx", f"{source.stem}.rel")
        listing = (folder / f"{source.stem}.rst").read_text(encoding="utf-8")
        return {
            ".ihx": (folder / f"{source.stem}.ihx").read_text(encoding="ascii"),
            ".lst": "".join(line.rstrip() + "\n" for line in listing.splitlines()),
            ".sym": symbols_of((folder / f"{source.stem}.sym").read_text(encoding="utf-8")),
        }


def output_of(source: Path, processor: str, suffix: str) -> Path:
    """Return where an output goes: the designs' of other processors than the first into a folder of that name.

    Examples
    --------
    >>> output_of(HERE / "a.asm", "one_clock_25mhz", ".ihx").relative_to(HERE).as_posix()
    'one_clock_25mhz/a.ihx'
    """
    apart = source.parent.resolve() == HERE and processor != PROCESSORS[0]
    return (source.parent / processor / source.name if apart else source).with_suffix(suffix)


def differences(source: Path, processor: str, outputs: dict[str, str]) -> list[str]:
    """Return what differs between fresh outputs and the files that are there."""
    found = []
    for suffix, fresh in outputs.items():
        path = output_of(source, processor, suffix)
        name = path.relative_to(source.parent).as_posix()
        if not path.is_file():
            found.append(f"{name}: missing")
        elif (kept := path.read_text(encoding="utf-8")) != fresh:
            pairs = zip(kept.splitlines(), fresh.splitlines(), strict=False)
            line = next((n for n, (old, new) in enumerate(pairs, 1) if old != new), None)
            where = f"line {line}" if line else "length"
            found.append(f"{name}: differs from what {source.name} assembles to, first in {where}")
    return found


def build(source: Path, processor: str, *, check: bool) -> list[str]:
    """Assemble one image and write its outputs, or compare them; return the differences."""
    outputs = assemble(source, processor)
    if check:
        return differences(source, processor, outputs)
    for suffix, text in outputs.items():
        path = output_of(source, processor, suffix)
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")
    return []


def main(arguments: list[str] | None = None) -> int:
    """Return 0 done, 1 a file differs, 2 it cannot be assembled."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sources", nargs="*", type=Path, metavar="SOURCE.asm", help="default: the four designs")
    parser.add_argument("--check", action="store_true", help="compare with the files there, write nothing")
    parser.add_argument(
        "--processor", choices=PROCESSORS, help=f"default: all for the four designs, {PROCESSORS[0]} for a SOURCE.asm"
    )
    chosen = parser.parse_args(arguments)
    sources = chosen.sources or [HERE / f"{design}.asm" for design in DESIGNS]
    processors = (chosen.processor,) if chosen.processor else PROCESSORS[:1] if chosen.sources else PROCESSORS
    try:
        found = [
            line
            for processor in processors
            for source in sources
            for line in build(source, processor, check=chosen.check)
        ]
    except (BuildError, OSError, subprocess.TimeoutExpired) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    for line in found:
        sys.stderr.write(f"{line}\n")
    if found:
        sys.stderr.write("assemble again: python firmware_model/images/build.py\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
