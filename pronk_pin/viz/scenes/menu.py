"""Menu of a page: scenes by named options."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from ..._checks import instance_of
from ...errors import InvalidInput
from .scene import Scene

Choice = Mapping[str, str]
"""One value for each option."""


@dataclass(frozen=True, eq=False)
class Menu:
    """Scenes of one robot, to choose from.

    Attributes:
        make: Makes the scene of a choice.
        options: The values of each option, as the page lists them.
        first: The choice that is shown first.
        embedded: Options, the most important one first, whose values listed here a file holds too.
        rounds: What a file holds besides, in this order as far as it reaches: all combinations of
            the values of a round, with the first choice's values of the other options.
    """

    make: Callable[[Choice], Scene]
    options: Mapping[str, Sequence[str]] = field(default_factory=dict)
    first: Choice = field(default_factory=dict)
    embedded: Mapping[str, Sequence[str]] = field(default_factory=dict)
    rounds: Sequence[Mapping[str, Sequence[str]]] = ()

    def __post_init__(self) -> None:
        self.check(self.first)

    @classmethod
    def of(cls, shown: Scene | Menu) -> Menu:
        """A menu as it is, a scene as a menu without choice."""
        if isinstance(shown, Menu):
            return shown
        scene = instance_of("shown", shown, Scene, "a Scene or a Menu")
        return cls(lambda choice: scene)

    def check(self, choice: Choice) -> None:
        """Check that a choice has a known value for each option, and no other.

        Raises:
            InvalidInput: It does not.
        """
        if set(choice) != set(self.options):
            wanted = ", ".join(self.options) or "nothing"
            raise InvalidInput(f"choose {wanted}, not {', '.join(map(str, choice)) or 'nothing'}")
        for name, value in choice.items():
            if value not in self.options[name]:
                known = ", ".join(self.options[name])
                raise InvalidInput(f"there is no {name} {value}; choose one of: {known}")

    def scene(self, choice: Choice | None = None) -> Scene:
        """The scene of a choice; by default of the first.

        Raises:
            InvalidInput: There is no such choice.
        """
        if choice is None:
            choice = self.first
        self.check(choice)
        return self.make(choice)

    def choices(self) -> Iterator[Choice]:
        """Choices that a file embeds: the first, all values of one option, of two, and so on."""
        names = list(self.embedded)
        growing = [
            {name: self.embedded[name] for name in names[:count]} for count in range(len(names) + 1)
        ]
        seen = set()
        for values_by_name in (*growing, *self.rounds):
            for values in product(*(self._first_first(values_by_name, n) for n in values_by_name)):
                choice = {**self.first, **dict(zip(values_by_name, values, strict=True))}
                key = tuple(choice.values())
                if key not in seen:
                    seen.add(key)
                    yield choice

    def _first_first(self, values: Mapping[str, Sequence[str]], name: str) -> list[str]:
        """The values of an option in a round, with the first choice's first if it is there."""
        return sorted(values[name], key=lambda value: value != self.first[name])
