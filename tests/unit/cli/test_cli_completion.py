"""The shell's completion: of the words that exist, and without loading what computes."""

import os
import subprocess
import sys

import can
import pytest
import typer

from rtec.axis.motion import MotionKind
from rtec.blind.plan import PLANS
from rtec.board import MICROCONTROLLERS
from rtec.campaign.safety_phases import Phase, hyphened
from rtec.campaign.safety_variants import VARIANTS
from rtec.cli import _words
from rtec.cli._verbs import application
from rtec.effects import LIBRARY
from rtec.training import all_methods


@pytest.mark.parametrize(
    ("words", "real"),
    [
        (_words.EFFECTS, [effect.name for effect in LIBRARY]),
        (_words.PROCESSORS, list(MICROCONTROLLERS)),
        (_words.PLANS, list(PLANS)),
        (
            _words.PREDICTORS,
            [method.name.replace(" ", "-") for method in all_methods(several_axes=True)][1:],
        ),
        (_words.FAULTS, list(dict.fromkeys(hyphened(variant.name.split(",")[0]) for variant in VARIANTS))),
        (_words.PHASES, [hyphened(phase.value) for phase in Phase]),
        (_words.MOTIONS, [kind.value for kind in MotionKind if kind is not MotionKind.PROGRAMME]),
    ],
)
def test_the_words_are_those_of_the_program(words, real):
    assert list(words) == real


def test_interfaces_are_those_of_python_can():
    assert set(_words.INTERFACES) <= set(can.VALID_INTERFACES)


def completed(folder, line):
    """Return what the shell is offered behind ``line``, and the modules that were loaded for it."""
    script = (
        "import sys; from rtec.cli import main\n"
        "try: main([])\n"
        "finally: print([m for m in ('numba', 'numpy', 'pint', 'matplotlib', 'can') if m in sys.modules],"
        " file=sys.stderr)\n"
    )
    words = line.split(" ")
    env = os.environ | {
        "_RTEC_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1),
        "PYTHONPATH": os.pathsep.join(sys.path),
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=env, cwd=folder, check=True
    )
    return done.stdout.split(), done.stderr.strip()


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("rtec simulate --design ", ["original", "a", "b", "c"]),
        ("rtec simulate --timing f", ["fast", "firmware"]),
        ("rtec simulate --motion a", ["adversary"]),
        ("rtec effects back", ["backlash", "backlash_map"]),
        ("rtec add backlash_", ["backlash_map"]),
        ("rtec run --processor one", ["one-clock-25mhz", "one-clock-100mhz"]),
        ("rtec box --interface so", ["socketcan", "socketcand"]),
        ("rtec check o", ["original"]),
        ("rtec check m", ["mine.ihx", "mine.py"]),
        ("rtec firmware run ", ["images/", "mine.ihx"]),
        ("rtec firmware run images/", ["images/c.hex"]),
        ("rtec firmware copy ", ["original", "a", "b", "c"]),
    ],
)
def test_what_the_shell_is_offered(tmp_path, line, offered):
    (tmp_path / "images").mkdir()
    for name in ("mine.ihx", "mine.py", "mine.txt", ".hidden.hex", "images/c.hex"):
        (tmp_path / name).touch()
    assert completed(tmp_path, line) == (offered, "[]")


def parameters(command, words=()):
    """Yield every parameter of every verb with the words that call it."""
    verbs = getattr(command, "commands", {})
    for name, inner in verbs.items():
        yield from parameters(inner, (*words, name))
    if not verbs:
        yield from ((words, parameter) for parameter in command.params)


def test_what_lists_its_values_completes_them_and_lists_them_once():
    group = typer.main.get_command(application())
    checked = 0
    for words, parameter in parameters(group):
        listed = (parameter.metavar or "").split("|")
        if len(listed) == 1 or not all(part.lower() == part and "'" not in part for part in listed):
            continue
        offered = [item.value for item in parameter.shell_complete(typer.Context(group), "")]
        assert offered == listed, (words, parameter.name)
        assert not all(part in (parameter.help or "") for part in listed), (words, parameter.name)
        checked += 1
    assert checked > 20
