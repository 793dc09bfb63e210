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
    """

    make: Callable[[Choice], Scene]
    options: Mapping[str, Sequence[str]] = field(default_factory=dict)
    first: Choice = field(default_factory=dict)
    embedded: Mapping[str, Sequence[str]] = field(default_factory=dict)

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
        yield self.first
        names = list(self.embedded)
        for count, last in enumerate(names, start=1):
            for values in product(*(self._values(name) for name in names[:count])):
                if values[-1] != self.first[last]:  # the others came before
                    yield {**self.first, **dict(zip(names[:count], values, strict=True))}

    def _values(self, name: str) -> list[str]:
        """The values of an option that a file holds, the first choice's first."""
        first = self.first[name]
        return [first, *(value for value in self.embedded[name] if value != first)]
