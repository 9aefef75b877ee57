"""The safety case as a page: definitions, tables, and what remains, all figures from the runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from statistics import median

from rtec.campaign.safety import SafetyCase, detection_of
from rtec.campaign.safety_matrix import LATE_S, Outcome, Trial
from rtec.campaign.safety_phases import Phase
from rtec.campaign.safety_ramp import LIMIT_MM
from rtec.campaign.safety_variants import Variant, impossible
from rtec.campaign.soak import MAIN, Soak
from rtec.injector import Design
from rtec.machine.faults import FaultKind

_OBSERVERS = {
    FaultKind.CABLE_OPEN: "a watch over the differential pairs; an index; a speed check, if it lasts",
    FaultKind.LINES_SWAPPED: "a speed check, at once: the counts go the other way; an index",
    FaultKind.LINE_BROKEN: "a watch over the differential pair; a speed check, if it lasts; an index",
    FaultKind.GLITCHES: "a narrower filter; an index",
}


def document(case: SafetyCase, *, command: str, picture: str) -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    case
        What the runs show.
    command
        That makes it.
    picture
        Name of the figure's file.
    """
    main = [design for design in case.matrix.plan.designs if design is not Design.B]
    parts = [_head(case, command)]
    if main:
        parts.append(f"## Original, A and C\n\nThe worst of all trials.\n\n{_table(case, main)}")
    if Design.B in case.matrix.plan.designs:
        parts.append(f"## Design B\n\n{_B}\n\n{_table(case, [Design.B])}")
    parts += [f"![Every fault in every phase, by what happens at the controller]({picture})", _late(case)]
    parts += [_detection(case), _remains(case), _ramps(case), _impossible(case)]
    if case.soak is not None:
        parts.append(_soak(case.soak))
    parts.append("[Documentation](index.md)")
    return "\n\n".join(parts) + "\n"


def _head(case: SafetyCase, command: str) -> str:
    plan = case.matrix.plan
    trials = case.matrix.trials
    fired = [trial for trial in trials if trial.fired]
    counts = Counter(trial.outcome for trial in fired)
    avoidable = len(case.matrix.avoidable)
    verdict = (
        "**None of them ended in wrong counts that nobody noticed and that a precaution of the report, a sequence "
        "counter or a checksum could have caught.**"
        if not avoidable
        else f"**{avoidable} of them ended in wrong counts that nobody noticed and a precaution could have caught.**"
    )
    return f"""# Safety case: every fault, in every phase of operation

"Every precaution must be taken to avoid mistakes. The errors that can be introduced into the machining process are
enormous, while the errors that can be compensated are small!" (NISTIR 4832, General Considerations). This page is
what the emulator says to that. It is made by

```sh
{command}
```

{len(plan.variants)} faults strike axis 1 of a machine of two axes in {len(plan.phases)} phases of its operation, with
{len(plan.designs)} designs and {plan.seeds} seeds each (other moments, bits, frames, states at rest): {len(trials)}
runs, of which the fault took effect in {len(fired)}; the others prove nothing and are left out. {verdict}
At the controller the counts were right in {counts[Outcome.RIGHT]} runs, late in {counts[Outcome.LATE]}, in
{counts[Outcome.HELD]} the fault was detected and the machine held, in {counts[Outcome.SILENT]} the counts were wrong
silently: all but {sum(t.outcome is Outcome.SILENT and not t.variant.upstream for t in fired)} of these began before the
box, in the encoder's cable ([what remains](#what-remains)).

## What is said of a run

Box, PC and bus are the two state machines of the package in simulated time, with all their frames; the axis is a
servo that follows a program, with counts of 1 um. The PC corrects by a table that changes by up to 20 um a millimetre
and has a backlash of 10 um. Every millisecond the count at the controller is held against a **reference that knows
nothing of box, link and PC**: the true count of the encoder, before its cable, and the deviation that the healthy
table has where the axis truly is, in the direction in which it truly moves. A run without the fault, the same in
everything else, is its twin.

| word | what it means |
|---|---|
| **right** | nobody stops the machine; in the end, at rest, the controller has exactly the encoder's counts and those of the steps that the box says are completed; the total is the one to be wanted there, to within rounding; and it was never off by more than one count beyond its twin, nor for more than 5 ms longer |
| **late** | as right in the end, but meanwhile it was off by more, or for longer; never for more than {LATE_S:.2f} s beyond its twin |
| **held** | somebody says so and the feed stops: the PC (HOLD on the bus, feed hold), the box (its hold contact opens; without power it is open), the controller (an illegal transition at its input, or the axis does not follow by 1 mm); or the axis is not let go because box and PC do not agree that it is at home |
| **silent** | anything else: wrong counts, and nobody says so |
| – | the fault cannot take effect there ([why](#what-cannot-strike)) |

"Off" takes a position's age into account: 60 ms of motion, two cycles of the box, a turn of the PC, and an insertion.
Steps that the speed gate still refuses are late, not wrong: box and PC know of them. A fault "for good" lasts to the
end of the run; where there is nothing to strike in its phase, it takes effect in the next one.

| phase | what the machine is doing |
|---|---|
| start-up | homing: the boxes take their homes, the PC waits for them |
| at rest | in position for two seconds, then on |
| cutting | 2 mm/s, with a correction every 0.1 to 0.3 s |
| rapid | 7 m/min: the gates of Original, A and C refuse on the report's 8051 |
| reversal | the 30 ms around the turn, in which the backlash is corrected |
| insertion | box and encoder: while the pulses of a correction go out; bus and PC: the request that asks for it |
| probing | announced by the PC: nothing is corrected |
| large correction | the table of a hot machine, 60 um away, comes at once under the flag Large Correction |"""


_B = """The processor stands in the lines: where it fails, so do they, and only the controller can notice ("the machine
tool controller must be relied on to fail gracefully with loss of position feedback"). Here it is fast logic; on the
8051 Design B loses its lines at the rapid traverse, without any fault ([envelope](envelope.md))."""


def _table(case: SafetyCase, designs: Sequence[Design]) -> str:
    phases = case.matrix.plan.phases
    lines = ["| fault | " + " | ".join(phase.value for phase in phases) + " |", "|---" * (len(phases) + 1) + "|"]
    for variant in case.matrix.plan.variants:
        cells = [_word(case.matrix.worst(variant, phase, designs)) for phase in phases]
        lines.append(f"| {variant.name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _word(outcome: Outcome) -> str:
    if outcome is Outcome.IMPOSSIBLE:
        return "–"
    return f"**{outcome.value}**" if outcome is Outcome.SILENT else outcome.value


def _late(case: SafetyCase) -> str:
    """Return the section about what is late."""
    lines = ["| fault | runs | off by more than its twin, at most | longer beyond rounding, at most |", "|---|---|---|---|"]
    for variant in case.matrix.plan.variants:
        late = [t for t in case.matrix.trials if t.variant is variant and t.fired and t.outcome is Outcome.LATE]
        if late:
            off = max(trial.off_counts for trial in late)
            lines.append(
                f"| {variant.name} | {len(late)} | {off:.0f} counts | {max(t.late_s for t in late) * 1e3:.0f} ms |"
            )
    return "## How late\n\n" + "\n".join(lines)


def _detection(case: SafetyCase) -> str:
    """Return the section about who finds out, and when."""
    lines = [
        "| fault | held | who said so | median | longest | off until then |",
        "|---|---|---|---|---|---|",
    ]
    for variant in case.matrix.plan.variants:
        trials = [t for t in case.matrix.trials if t.variant is variant and t.fired]
        found = detection_of(trials)
        if found.held:
            lines.append(
                f"| {variant.name} | {found.held} of {len(trials)} | {'; '.join(found.reasons)} | "
                f"{_ms(found.median_s)} | {_ms(found.longest_s)} | {found.off_counts:.0f} |"
            )
    return (
        "## How it is found out\n\nAll designs and phases together. The time goes from the fault's first effect to "
        "the moment at which the first axis is stopped; the feed then takes 50 ms to come down. The last column is the "
        "largest number of counts that a controller was off until then, more than in the fault-free run; a fault "
        "before the box is in it with what the encoder lost. \"The axis is not let go\": box and PC do not come to "
        "terms about its home, and nothing moves.\n\n" + "\n".join(lines)
    )


def _ms(time_s: float | None) -> str:
    return "–" if time_s is None else f"{time_s * 1e3:.0f} ms"


def _remains(case: SafetyCase) -> str:
    silent = [trial for trial in case.matrix.trials if trial.fired and trial.outcome is Outcome.SILENT]
    upstream = [trial for trial in silent if trial.variant.upstream]
    lines = [
        "| fault | silent | counts lost, at most | a speed check would have seen | what could observe it |",
        "|---|---|---|---|---|",
    ]
    for variant, some in _by_variant(upstream):
        fired = sum(t.fired > 0 for t in case.matrix.trials if t.variant is variant)
        seen = median(max(trial.following_counts, 0.0) for trial in some)
        left = max(abs(trial.left_counts) for trial in some)
        lines.append(
            f"| {variant.name} | {len(some)} of {fired} | {left} | {seen:.0f} counts | {_OBSERVERS[variant.kind]} |"
        )
    others = [trial for trial in silent if not trial.variant.upstream]
    words = "Nothing else ended silently." if not others else _others(others)
    return (
        "## What remains\n\n**The encoder's lines before the box.** Box and controller see the same wrong lines, so "
        "no comparison between them can tell: a line that freezes for a while, a pair of glitches that counts. What is "
        "lost is lost for good, until an index or another home. The controller's own check, 1 mm beyond the lag of the "
        "feed, is too wide for 50 ms at 2 mm/s (100 counts). The column \"a speed check\" is how much further behind "
        "its command the axis seemed to be than without the fault (median): a check narrower than that would have "
        "caught it.\n\n"
        + "\n".join(lines)
        + f"\n\n{words}\n\n"
        "**Design B without power.** Its outputs are dead: the controller sees an axis that does not move. The box's "
        "hold contact, which is open without power, stops the machine; without that contact wired, only the "
        "controller's check of the following error does, and the counts of the way to the stop are lost. The report "
        "says as much.\n\n"
        "**An axis pushed while everything is off**, a home switch that is wrong, a table that is wrong from the "
        "beginning: they are the same for every corrector, and none of these precautions looks at them."
    )


def _others(trials: Sequence[Trial]) -> str:
    named = Counter(f"{trial.variant.name}, {trial.phase.value}, Design {trial.design.value}" for trial in trials)
    return "Also silent: " + "; ".join(f"{name} ({count})" for name, count in named.items()) + "."


def _by_variant(trials: Sequence[Trial]) -> list[tuple[Variant, list[Trial]]]:
    variants = dict.fromkeys(trial.variant for trial in trials)
    return [(variant, [trial for trial in trials if trial.variant is variant]) for variant in variants]


def _ramps(case: SafetyCase) -> str:
    lines = ["| design | option | outcome | who said so | off by |", "|---|---|---|---|---|"]
    lines += [
        f"| {ramp.design.value} | {ramp.limit} | {_word(ramp.outcome)} | {ramp.reason or '–'} | {ramp.off_mm * 1e3:.0f} um |"
        for ramp in case.ramps
    ]
    return (
        "**A PC that runs away within every window.** Its prediction drifts by 60 um a second: a step or so with "
        "every request, each of them right in form and within the window. No handshake can tell that from a machine "
        "that grows warm. What helps is a limit of the plausible, an option at either side: `limit_steps` in the box, "
        f"`limit_mm` in the PC; here {LIMIT_MM * 1e3:.0f} um, where the healthy table stays within 30 um.\n\n"
        + "\n".join(lines)
    )


def _impossible(case: SafetyCase) -> str:
    reasons: dict[str, list[str]] = {}
    for variant in case.matrix.plan.variants:
        for phase in case.matrix.plan.phases:
            reason = impossible(variant, phase)
            if reason is not None:
                reasons.setdefault(reason, []).append(f"{variant.name} ({phase.value})")
    lines = [f"- {'; '.join(names)}: {reason}." for reason, names in reasons.items()]
    return "## What cannot strike\n\n" + "\n".join(lines)


def _soak(soak: Soak) -> str:
    """Return the section about the soak."""
    silent = soak.silent(upstream=False)
    fired = soak.fired()
    outcomes = soak.outcomes()
    phases = Counter(s.phase for e in soak.episodes for s in e.struck if e.design in MAIN)
    held = Counter(e.reason for e in soak.episodes if e.outcome is Outcome.HELD and e.design in MAIN)
    lost = soak.silent(upstream=True)
    return f"""## Soak

{soak.hours():.1f} hours of machine time on three axes with the Original, A and C, in episodes of up to
{soak.plan.episode_s / 60:.0f} minutes: random programs (0.5 to 5 mm/s, rapids of up to 7 m/min, rests, reversals),
probing, large corrections, and faults at random moments and places, {sum(fired.values())} that took effect. A machine
that is held ends its episode; only time that was run counts. Every axis is looked at every 5 ms, and at every rest all
counts must be right: {_thousands(sum(e.checks for e in soak.episodes))} looks at an axis at rest were,
{sum(e.travel_mm for e in soak.episodes) / 1e6:.1f} km of travel lay between them.

Episodes: {outcomes[Outcome.RIGHT]} ended right, {outcomes[Outcome.HELD]} held, {len(silent)} with counts that were wrong
and unnoticed because of box, link or PC, {len(lost)} with counts lost before the box. Design B apart:
{soak.hours([Design.B]):.1f} hours, {_counted(soak.outcomes([Design.B]), lambda outcome: outcome.value)}.

| class | took effect |
|---|---|
{chr(10).join(f"| {kind.value} | {fired[kind]} |" for kind in FaultKind)}

By phase: {_counted(phases, lambda phase: phase.value)}. Held by: {_counted(held, str)}.
{_lost(soak)}"""


def _lost(soak: Soak) -> str:
    """Return what was lost before the box."""
    lost = soak.silent(upstream=True)
    if not lost:
        return ""
    named = Counter(episode.struck[0].variant for episode in lost)
    lines = [f"- {variant.name}: {count}; {_OBSERVERS[variant.kind]}" for variant, count in named.items()]
    return "\nCounts lost before the box, and what could observe it:\n\n" + "\n".join(lines)


def _counted(counter: Counter[Phase] | Counter[str] | Counter[Outcome], name: Callable[..., str]) -> str:
    return ", ".join(f"{name(key)} {count}" for key, count in counter.most_common())


def _thousands(number: int) -> str:
    return f"{number / 1e6:.1f} million" if number >= 1e6 else f"{number}"
