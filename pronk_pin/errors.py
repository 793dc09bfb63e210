"""Errors that pronk_pin raises on purpose.

Each class carries what is needed to investigate, and its message names the remedy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

_LONGEST_WORD = 60
"""Characters of an unknown name that its error shows."""


_NEIGHBOUR = "by 'gaits build' with that in --speeds or --apex too, or optimize_gait(initial=...)"


class PronkError(Exception):
    """Base class of all errors of this package."""

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the finished message, so that errors of worker processes arrive whole."""
        return _restore, (type(self), str(self)), self.__dict__


def _restore(kind: type[PronkError], message: str) -> PronkError:
    """Restore an error from its message; `__init__` would ask for what the message was made of."""
    error = kind.__new__(kind)
    error.args = (message,)
    return error


class UnknownName(PronkError):
    """A robot, controller, scenario or the like that does not exist.

    Attributes:
        kind: What was looked for, as in "controller".
        name: The name that was given.
        known: The names that exist.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        self.kind, self.name, self.known = kind, name, tuple(known)
        word = " ".join(name.split())  # in one line, however long
        word = word if len(word) <= _LONGEST_WORD else f"{word[:_LONGEST_WORD]}..."
        super().__init__(f"unknown {kind} '{word}'; choose one of: {', '.join(self.known)}")


class InvalidInput(PronkError):
    """An argument of the wrong shape, type or range; the message says what is expected."""


class SpeedOutOfRange(PronkError):
    """A speed that a library of gaits or of torques does not cover.

    Attributes:
        speed: The speed asked for [m/s].
        lowest, highest: The range of the library [m/s].
    """

    def __init__(
        self,
        speed: float,
        lowest: float,
        highest: float,
        *,
        library: str = "gait library",
        remedy: str = "make a library with it by 'pronk-pin gaits build', and give its file to "
        "compare with --gaits, or to gaits with --library",
    ) -> None:
        self.speed, self.lowest, self.highest = speed, lowest, highest
        super().__init__(
            f"speed {speed:g} m/s is outside the {library}, which covers {lowest:g} to "
            f"{highest:g} m/s; choose a speed in that range, or {remedy}"
        )


class ApexOutOfRange(PronkError):
    """An apex height that the gait library does not cover.

    Attributes:
        apex: The apex asked for [m].
        lowest, highest: The range of the library [m].
    """

    def __init__(self, apex: float, lowest: float, highest: float) -> None:
        self.apex, self.lowest, self.highest = apex, lowest, highest
        super().__init__(
            f"apex {apex:g} m is outside the gait library, which covers {lowest:g} to "
            f"{highest:g} m; choose an apex in that range, or make a library with it by "
            "'pronk-pin gaits build --apex'"
        )


class FileProblem(PronkError):
    """A file or folder that is missing, damaged, or cannot be written.

    Attributes:
        path: The file or folder.
        problem: What is wrong with it.
    """

    def __init__(self, path: Path | str, problem: str, remedy: str) -> None:
        self.path, self.problem = Path(path), problem
        super().__init__(f"{path}: {problem}; {remedy}")


def cannot_write(
    path: Path | str, error: Exception, remedy: str = "choose another place, or make room"
) -> FileProblem:
    """Make the `FileProblem` of a file or folder that the system, or a library, fails to write."""
    reason = getattr(error, "strerror", None) or error
    return FileProblem(path, f"cannot be written ({reason})", remedy)


class IntegrationFailed(PronkError):
    """A simulation that the integrator could not bring to its end.

    Attributes:
        reached: How far it came [s].
        duration: How far it was to go [s].
        reason: What the integrator said.
    """

    def __init__(self, reached: float, duration: float, reason: str) -> None:
        self.reached, self.duration, self.reason = reached, duration, reason
        super().__init__(
            f"the simulation stopped at {reached:g} s of {duration:g} s ({reason}); the torques "
            "may drive it into a singular posture: shorten the duration, or raise the tolerance"
        )


class GaitNotFound(PronkError):
    """The gait optimisation did not find a solution.

    Attributes:
        speed: The speed of the gait [m/s].
        status: What the solver said.
        violations: Worst violation of each named constraint where the solver stopped.
        fights: By how much which demands have to give way so that a gait exists, in their units;
            empty where none has to, None where that was not asked for or has no answer.
    """

    def __init__(
        self,
        speed: float,
        status: str,
        violations: dict[str, float],
        fights: dict[str, float] | None = None,
        remedies: Iterable[str] = (),
    ) -> None:
        self.speed, self.status = speed, status
        self.violations = dict(violations)
        self.conflicts = None if fights is None else dict(fights)
        if self.conflicts:
            gives = ", ".join(f"{name} by {value:.2g}" for name, value in self.conflicts.items())
            advice = f"these demands fight, and must give way: {gives}; {'; '.join(remedies)}"
        elif self.conflicts is not None:
            advice = (
                "its demands do not fight, a gait exists on a coarse mesh: start from the solution "
                f"of a neighbouring speed or apex ({_NEIGHBOUR})"
            )
        else:
            worst = sorted(violations.items(), key=lambda item: -item[1])[:3]
            listed = ", ".join(f"{name} {value:.1e}" for name, value in worst)
            advice = (
                f"worst violations: {listed}; start from a neighbouring speed's solution "
                f"({_NEIGHBOUR})"
            )
        super().__init__(f"no gait found at {speed:g} m/s ({status}); {advice}")

    def with_note(self, note: str) -> GaitNotFound:
        """The same error with something added to its message."""
        self.args = (f"{self.args[0]}; {note}",)
        return self


class WorkerLost(PronkError):
    """Workers ended in the middle of their work again and again, for want of memory perhaps.

    Attributes:
        folder: The folder that holds what was finished.
        of_script: Whether they need a class or function of the main script.
    """

    def __init__(self, folder: Path, *, of_script: bool = False) -> None:
        self.folder, self.of_script = folder, of_script
        why = "for want of memory perhaps"
        if of_script:
            why += (
                ", or because they did not find a class or function of the script, which must "
                "stand in its file above `if __name__ == '__main__'`, or in a module"
            )
        super().__init__(
            f"workers ended unexpectedly, {why}; what was finished is kept: "
            f"run the same command again with '--folder {folder} --workers 1' to complete it"
        )


class NoMainGuard(PronkError):
    """A script that starts processes, which import it, and would start their own.

    Attributes:
        script: Its path.
    """

    def __init__(self, script: str) -> None:
        self.script = script
        super().__init__(
            f"{script}: the processes that it starts import it and come to its main code again; "
            "guard your script with `if __name__ == '__main__':`, or give workers=1"
        )


class ExecutorUnavailable(PronkError):
    """An executor beyond this machine that cannot be used.

    Attributes:
        address: Its address.
        problem: What is wrong with it.
    """

    def __init__(self, address: str, problem: str, remedy: str) -> None:
        self.address, self.problem = address, problem
        super().__init__(f"{address}: {problem}; {remedy}")


class MissingExtra(PronkError):
    """Something that is asked for needs a package that is not installed.

    Attributes:
        package: The package.
        extra: The extra of this package that brings it.
    """

    def __init__(self, package: str, extra: str) -> None:
        self.package, self.extra = package, extra
        super().__init__(f"{package} is not installed; pip install 'pronk-pin[{extra}]'")


class PortUnavailable(PronkError):
    """A port that the live page cannot have.

    Attributes:
        host: The address it was to listen on.
        ports: The port or ports that were tried.
        reason: What the system said.
    """

    def __init__(self, host: str, ports: range, reason: str) -> None:
        self.host, self.ports, self.reason = host, ports, reason
        tried = f"port {ports[0]}" if len(ports) == 1 else f"ports {ports[0]} to {ports[-1]}"
        super().__init__(
            f"{tried} of {host} cannot be used ({reason}); choose another with --port, "
            "or leave it out to get a free one"
        )


class OtherMachine(UserWarning):
    """A result that is completed on another machine than it was begun on: last bits may differ.

    Attributes:
        folder: The results folder.
        differences: What differs.
    """

    def __init__(self, folder: Path, differences: str) -> None:
        self.folder, self.differences = folder, differences
        super().__init__(
            f"{folder} was begun elsewhere ({differences}): the last bits of what is simulated "
            "now may differ from those of a run in one place"
        )


class LeakyFilter(UserWarning):
    """A learning filter whose DC gain is not 1: it loses, or adds, torque in each stride."""


class NoBrowser(PronkError):
    """There is no browser to draw pictures and films with, or it does not do it.

    Attributes:
        reason: What is wrong.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(
            f"pictures and films are drawn by Chromium or Chrome without a window, and {reason}; "
            "install one ('apt install chromium'), or name its program in the environment variable "
            "PRONK_PIN_BROWSER; pages (--html) need none here"
        )


class PartNotShown(UserWarning):
    """Parts of a robot that its pictures leave out.

    Attributes:
        robot: Name of the robot.
        parts: Their names, and why they cannot be shown.
    """

    def __init__(self, robot: str, parts: Sequence[tuple[str, str]]) -> None:
        self.robot, self.parts = robot, tuple(parts)
        (name, reason), *others = self.parts
        super().__init__(
            f"{robot} is shown without {name} ({reason})"
            + (
                f" and {len(others)} more: {', '.join(other for other, _ in others)}"
                if others
                else ""
            )
        )
