"""The models next to one: an effect larger, as a scan of the data proposes, or an effect smaller."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from rtec.effects import Effect
from rtec.inference.probes import Probe
from rtec.inference.proposals import proposals
from rtec.inference.scored import Judge, Scored
from rtec.inference.space import Choice

PROMISING = 24
"""Proposals of the scan that are weighed under the model's noise."""
CLOSER, CLOSER_GENERIC = 6, 2
"""Proposals beside each model that are scored with their own noise; probes among them, which have many columns."""
MOST_EFFECTS = 9


@dataclass(slots=True, eq=False)
class Neighbours:
    """The models next to one; the effects ``given`` stay, those ``barred`` are not looked for.

    Waves are looked for one by one if ``single``, else as families of harmonics.
    """

    judge: Judge
    given: tuple[Choice, ...] = ()
    barred: frozenset[str] = frozenset()
    single: bool = False
    _children: dict[object, list[Scored]] = field(default_factory=dict)

    def effects_for(self, model: Scored) -> list[Effect]:
        """Return the effects that may be added to a model."""
        names = list(model.names)
        return [
            effect
            for effect in self.judge.space.library
            if names.count(effect.name) < effect.at_most
            and effect.name not in self.barred
            and not (effect.builds_on and not effect.builds_on & set(names))
        ]

    def without(self, model: Scored, k: int) -> Scored:
        """Return a model without its effect ``k``, and without what builds on that."""
        return self.judge.score(self.rest(model, k), model)

    def rest(self, model: Scored, k: int) -> list[Choice]:
        """Return the choices of that."""
        rest = [choice for i, choice in enumerate(model.choices) if i != k]
        held = {effect.name for effect, _ in rest}
        return [c for c in rest if not c[0].builds_on or c[0].builds_on & held or c in self.given]

    def children(self, model: Scored) -> list[Scored]:
        """Return the models one effect larger that the scan proposes, scored."""
        key = model.key, self.barred, self.single
        if key not in self._children:
            self._children[key] = self.proposed(model, self.effects_for(model))
        return self._children[key]

    def proposed(self, model: Scored, effects: Iterable[Effect]) -> list[Scored]:
        """Return the models with one of the effects besides that the scan proposes, scored."""
        if len(model.choices) >= MOST_EFFECTS:
            return []
        found = proposals(self.judge, model, effects, families=not self.single)
        generic = [p.choice for p in found if isinstance(p.choice[0], Probe)]
        promising = [p.choice for p in found if p.choice not in generic][:PROMISING]
        worth = {choice: self.judge.quickly([*model.choices, choice], model) for choice in (*generic, *promising)}
        closer = sorted(worth, key=lambda choice: -worth[choice])[:CLOSER]
        probes = [choice for choice in closer if isinstance(choice[0], Probe)]
        return [self.judge.score([*model.choices, c], model) for c in closer if c not in probes[CLOSER_GENERIC:]]
