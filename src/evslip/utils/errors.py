"""The errors a user can meet. Each message is one line: what was wrong, where, and what would be right."""

from typing import Any, NoReturn

LONGEST = 1500


class EvslipError(Exception):
    """Base of every error evslip raises on purpose; the command line prints its one line and exits with code 2. Of a
    message with a name or a value of any length the middle is left out."""

    def __init__(self, message: str = ""):
        long = len(message) > LONGEST
        super().__init__(f"{message[: LONGEST // 2]} ... {message[-LONGEST // 2 :]}" if long else message)


class ConfigError(EvslipError):
    """A configuration key is unknown, of the wrong type, out of range, or asks for what the robot cannot do."""


class Rejection(EvslipError):
    """One sample cannot be made. Of a sample among others recorded at its index, never redrawn.

    `kind` is a short stable name.
    """

    def __init__(self, kind: str, message: str):
        super().__init__(message)
        self.kind = kind

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        return type(self), (self.kind, str(self))


class PlanRejected(Rejection, ConfigError):
    """The robot cannot do the motion: "unreachable", "joint_limit", "too_fast", "too_long", "collision", "grip",
    "disturbance". Or no camera can see it: "camera"."""


class DataError(EvslipError):
    """A file or folder is missing, empty, truncated, damaged, or not what it claims to be."""


class StorageError(EvslipError):
    """The disk refused: full, read-only, or not permitted."""


class MissingExtraError(EvslipError):
    """An optional package is not installed; the message names the command that installs it."""


class GraspFailed(Rejection):
    """The physics let the grasp fail, which is no user error: "never_closed", "never_lifted", "unstable"."""


class MissingName:
    """Stand-in for a public name whose package is not installed: it can be listed and imported, for tab completion and
    `help`, but whatever is done with it raises MissingExtraError."""

    def __init__(self, name: str, remedy: str):
        self._name, self._remedy = name, remedy

    def __repr__(self) -> str:
        return f"<{self._name}: {self._remedy}>"

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise MissingExtraError(self._remedy)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # asked for by those who look at objects
            raise AttributeError(name)
        self._refuse()

    __call__ = __getitem__ = __iter__ = __contains__ = __mro_entries__ = __instancecheck__ = _refuse
