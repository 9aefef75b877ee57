"""Leave out each rule about names in turn, and print docs/rules.md: what every rule asks, and what it is worth.

Every answer is appended to the file of ``--resume`` as it comes: the same command goes on where it was stopped.

Example::

    python -m tools.rule_worth --resume rules.jsonl "real files=measurements" --trials 5 --line 0 --line 2

A folder of measurements holds ``expected.json`` or ``truth.json``. Of each case (the name of a CSV file without its
ending) the first may say which ``verdicts`` are acceptable; which effects it ``must`` name (``a|b``: one of them;
those tied count), if NAMED or LIKELY (``if_named``), ``may`` accept (``*``: any) or ``never``; what to ``observe``,
further ``options``, and ``most_left``, the largest RMS of the residual in the unit of the answer. The second says
which ``effects`` were planted, of which ``kind`` the case is (``known`` ones are to be found), and which names are
``tolerated``.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import io
import itertools
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

from rtec.blind.confusion import GameJob
from rtec.blind.judged import judged
from rtec.blind.line import Line
from rtec.blind.lines import the_lines
from rtec.cli import main as rtec
from rtec.inference import forms, rules
from rtec.inference.rules import RULES
from rtec.report.rendering import markdown_page
from tools.record import mcnemar

TEMPLATE = Path(__file__).with_name("rule_worth.md.j2")
GAMES = "games"
SAID = ("NAMED", "LIKELY", "TIED")
SAME = {"eccentricity": "cyclic", "interpolation": "cyclic"}
"""A wave of a stated period has two names."""
ALWAYS = ("sign", "by chance", "worth")
"""Rules that are asked elsewhere, too, or that look at other models on the way."""
RAISES, SIGNIFICANT = 1.01, 0.01
_BAD, _STOPPED = 2, 128


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """An answer without a rule; with all of them where it has no name."""

    rule: str
    evidence: str
    case: str
    right: bool
    names: tuple[str, ...]
    """That were accepted."""
    wrong: tuple[str, ...]
    """Those of them that are not there, where the verdict stands for them."""
    heard: tuple[str, ...] = ()
    """Rules that objected to anything on the way: without another the answer is the same."""

    @property
    def key(self) -> tuple[str, str, str]:
        """What was asked."""
        return self.rule, self.evidence, self.case


Ask = Callable[[], tuple[bool, Sequence[str], Sequence[str]]]
"""Plays one case: whether it is right, the names accepted, and the wrong ones of them."""


def answer(file: Path, observe: str | None, options: Sequence[str]) -> dict[str, Any] | None:
    """Return the document of ``rtec diagnose --json``; None where there is none."""
    said = io.StringIO()
    words = ["diagnose", str(file), "--json", *([] if observe is None else ["--observe", observe]), *options]
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
        code = rtec(words)
    if code >= _STOPPED:
        raise KeyboardInterrupt
    try:
        document: dict[str, Any] = json.loads(said.getvalue())
    except ValueError:
        return None
    return document


def _named(found: Mapping[str, Any]) -> set[str]:
    """Return the names accepted, and those tied with them."""
    named = set(found["effects"])
    for candidate in found["candidates"]:
        tied = set(candidate.get("tied_with") or ())
        if tied and (tied & set(found["effects"]) or found["verdict"] == "TIED"):
            named |= {candidate["effect"], *tied}
    return named


def _is_consistent(found: Mapping[str, Any]) -> bool:
    """Return whether no step raises an error, and each effect passes its own test under NAMED and LIKELY."""
    steps = found["steps"]
    for before, after in itertools.pairwise(steps):
        for key in ("rms_train", "rms_heldout"):
            if before.get(key) and after.get(key) and after[key] > RAISES * before[key]:
                return False
    own = [step for step in steps if step["effect"] in found["effects"] and found["verdict"] in ("NAMED", "LIKELY")]
    return all(step["p_adjusted"] < SIGNIFICANT for step in own)


def by_expectation(found: Mapping[str, Any], case: Mapping[str, Any]) -> tuple[bool, set[str]]:
    """Return whether an answer is as expected, and the names that should not be there."""
    accepted, verdict = set(found["effects"]), found["verdict"]
    wanted = case.get("must", []) + (case.get("if_named", []) if verdict in ("NAMED", "LIKELY") else [])
    may = {*case.get("may", ["*"]), *(name for entry in wanted for name in entry.split("|")), "offset"}
    wrong = accepted & set(case.get("never", [])) | (set() if "*" in may else accepted - may)
    right = (
        not wrong
        and verdict in case.get("verdicts", [verdict])
        and all(set(entry.split("|")) & _named(found) for entry in wanted)
        and found["rms_after"] <= case.get("most_left", found["rms_after"])
    )
    return right and _is_consistent(found), wrong


def by_truth(found: Mapping[str, Any], case: Mapping[str, Any]) -> tuple[bool, set[str]]:
    """Return whether an answer tells what was planted, and the names that were not."""
    truth = {*case["effects"], *(SAME.get(name, name) for name in case["effects"])}
    strange = {e for e in found["effects"] if e not in truth and SAME.get(e, e) not in truth}
    wrong = strange - {*case["tolerated"], "offset"} if found["verdict"] in SAID else set()
    named = _named(found)
    missed = [e for e in case["effects"] if e not in named and SAME.get(e, e) not in named]
    return not wrong and not (missed and case["kind"] == "known") and _is_consistent(found), wrong


def cases_of(folder: Path) -> Iterator[tuple[str, Ask]]:
    """Yield the cases of a folder."""
    expected = folder / "expected.json"
    judge, file = (by_expectation, expected) if expected.exists() else (by_truth, folder / "truth.json")
    for name, case in sorted(json.loads(file.read_text(encoding="utf-8")).items()):

        def ask(name: str = name, case: Mapping[str, Any] = case) -> tuple[bool, Sequence[str], Sequence[str]]:
            found = answer(folder / f"{name}.csv", case.get("observe"), case.get("options", []))
            if found is None:
                return False, (), ()
            right, wrong = judge(found, case)
            return right, sorted(found["effects"]), sorted(wrong)

        yield name, ask


def games_of(lines: Sequence[Line], trials: int, seed: int) -> Iterator[tuple[str, Ask]]:
    """Yield the games of some lines."""
    for line in lines:
        for trial in range(trials):

            def ask(line: Line = line, trial: int = trial) -> tuple[bool, Sequence[str], Sequence[str]]:
                game = GameJob(line=line, trial=trial, seed=seed, judge=judged, refit=None).run()
                wrong = set(game.effects) - set(game.names) if game.verdict in SAID else set()
                return bool(game.right), sorted(game.effects), sorted(wrong)

            yield f"{line.title}, {trial}", ask


def play(evidence: Mapping[str, Sequence[tuple[str, Ask]]], without: Sequence[str], path: Path) -> list[Played]:
    """Return every answer, those that a file holds from there; the others are appended to it."""
    known: dict[tuple[str, str, str], Played] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            document = json.loads(line)
            document |= {name: tuple(document[name]) for name in ("names", "wrong", "heard")}
            one = Played(**document)
            known[one.key] = one
    found, ruled = [], {rule.name for rule in RULES}
    for rule in without:
        for title, cases in evidence.items():
            for case, ask in cases:
                key, whole = (rule, title, case), known.get(("", title, case))
                if key not in known and whole is not None and rule in ruled - set(whole.heard):
                    known[key] = replace(whole, rule=rule)
                elif key not in known:
                    known[key] = _asked(rule, title, case, ask)
                    gc.collect()  # a search holds hundreds of megabytes in circles
                    with path.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(asdict(known[key])) + "\n")
                found.append(known[key])
        sys.stderr.write(f"without {rule or 'none'}: {sum(p.right for p in found if p.rule == rule)} right\n")
    return found


@contextlib.contextmanager
def hearing() -> Iterator[set[str]]:
    """Note which rules object to anything."""
    heard = set(ALWAYS)

    def noting(name: str, asked: Callable[..., Any]) -> Callable[..., Any]:
        def ask(*about: Any) -> Any:
            said = asked(*about)
            if said:
                heard.add(name)
            return said

        return ask

    of_forms = {field.name: field.name for field in fields(forms.Forms)} | {"gradual": "softer"}
    asked = {of_forms[rule.name]: rule.name for rule in RULES if rule.name in of_forms}
    noted = {}
    for effect, own in forms.FORMS.items():
        heeded: dict[str, Any] = {field: noting(rule, getattr(own, field)) for field, rule in asked.items()}
        noted[effect] = replace(own, **heeded)
    table = tuple(replace(rule, applies=noting(rule.name, rule.applies)) for rule in RULES)
    with patch.object(forms, "FORMS", noted), patch.object(rules, "RULES", table):
        yield heard


def _asked(rule: str, title: str, case: str, ask: Ask) -> Played:
    if rule:
        heard: set[str] = set()
        with forms.left_out(rule):
            right, names, wrong = ask()
    else:
        with hearing() as heard:
            right, names, wrong = ask()
    return Played(
        rule=rule,
        evidence=title,
        case=case,
        right=right,
        names=tuple(names),
        wrong=tuple(wrong),
        heard=tuple(sorted(heard)),
    )


def rows(played: Sequence[Played], titles: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield what each rule is worth: right with and without it by evidence, names that change, McNemar's p."""
    whole = {(p.evidence, p.case): p for p in played if not p.rule}
    for rule in RULES:
        without = [(whole[p.evidence, p.case], p) for p in played if p.rule == rule.name]
        if not without:
            continue
        counts = []
        for title in titles:
            own = [(one.right, other.right) for one, other in without if one.evidence == title]
            counts.append(f"{sum(one for one, _ in own)} → {sum(other for _, other in own)}")
        worse = sum(one.right and not other.right for one, other in without)
        better = sum(other.right and not one.right for one, other in without)
        new = sum(bool(set(other.wrong) - set(one.wrong)) for one, other in without)
        changed = sum(one.names != other.names for one, other in without)
        p = f"{mcnemar(worse, better):.2g}"
        yield rule.name, *counts, str(changed), str(better), str(worse), str(new), p


def page(played: Sequence[Played], evidence: Mapping[str, int], command: str) -> str:
    """Return the page as Markdown."""
    return markdown_page(
        TEMPLATE,
        rules=[(rule.name, rule.asks, rule.earned) for rule in RULES],
        rows=list(rows(played, list(evidence))),
        evidence=evidence,
        headings=("rule", *evidence, "names changed", "better", "worse", "new wrong", "p"),
        command=command,
    )


def main() -> int:
    """Play, and write the page."""
    parser = argparse.ArgumentParser(description="Regenerate docs/rules.md.")
    parser.add_argument("folders", nargs="*", metavar="TITLE=FOLDER", help="measurements, and what to call them")
    parser.add_argument("--trials", type=int, default=0, help="games on each line")
    parser.add_argument("--line", type=int, action="append", default=[], help="number of a line, from 0")
    parser.add_argument("--seed", type=int, default=0, help="of all games")
    parser.add_argument("--rule", action="append", help="only this rule; may be given several times")
    parser.add_argument("--resume", type=Path, required=True, metavar="FILE.jsonl", help="answers; new ones go there")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    evidence: dict[str, list[tuple[str, Ask]]] = {}
    for text in given.folders:
        title, _, folder = text.partition("=")
        if not Path(folder).is_dir():
            sys.stderr.write(f"{text}: give TITLE=FOLDER, a folder with expected.json or truth.json\n")
            return _BAD
        evidence[title] = list(cases_of(Path(folder)))
    if given.trials:
        evidence[GAMES] = list(games_of([the_lines()[k] for k in given.line], given.trials, given.seed))
    played = play(evidence, ["", *(given.rule or [rule.name for rule in RULES])], given.resume)
    text = page(played, {title: len(cases) for title, cases in evidence.items()}, _command(given))
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text, encoding="utf-8")
    return 0


def _command(given: argparse.Namespace) -> str:
    games = f" --trials {given.trials}{''.join(f' --line {k}' for k in given.line)}" if given.trials else ""
    return f"python -m tools.rule_worth --resume FILE.jsonl TITLE=FOLDER ...{games} -o docs/rules.md"


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main())
