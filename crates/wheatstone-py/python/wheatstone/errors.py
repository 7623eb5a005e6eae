"""Exceptions. Each says what is wrong, and in ``hint`` what to do about it.

Every exception of this package is a `WheatstoneError`, and of the built-in class that Python's own code would raise:
a `MissingFileError` is a `FileNotFoundError`, an `ArgumentError` a `ValueError`. Python's own `TypeError` is left for a
number where a path, a name, a switch or an object of this package belongs.
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable

__all__ = [
    "ArgumentError",
    "CancelledError",
    "ChartNotFoundError",
    "DataWarning",
    "DegenerateError",
    "FaultyError",
    "FileError",
    "ImageError",
    "MalformedError",
    "MismatchError",
    "MissingFileError",
    "NotComputedError",
    "SettingError",
    "TooFewError",
    "UnknownNameError",
    "UnsupportedError",
    "WheatstoneError",
]


class WheatstoneError(Exception):
    """The base of all exceptions of this package.

    Attributes
    ----------
    hint : str or None
        What to do about it, in one sentence.
    code : str or None
        A name that stays, in kebab case: of a fault of the data its own (``"cameras-swapped"``), of other errors
        their kind.
    """

    hint: str | None
    code: str | None

    def __init__(self, message: str, *, hint: str | None = None, code: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint
        self.code = code

    def __str__(self) -> str:
        text = str(self.args[0]) if self.args else ""
        return f"{text}\nhint: {self.hint}" if self.hint else text

    def __reduce__(
        self,
    ) -> tuple[
        Callable[[type[WheatstoneError], str, str | None, str | None], WheatstoneError],
        tuple[type[WheatstoneError], str, str | None, str | None],
    ]:
        return _restored, (type(self), str(self.args[0]), self.hint, self.code)


def _restored(
    kind: type[WheatstoneError], message: str, hint: str | None, code: str | None
) -> WheatstoneError:
    return kind(message, hint=hint, code=code)


class FileError(WheatstoneError, OSError):
    """A file could not be read or written."""


class MissingFileError(FileError, FileNotFoundError):
    """There is no such file."""


class MalformedError(WheatstoneError, ValueError):
    """A file or a table is not what its reader needs."""


class ImageError(WheatstoneError, ValueError):
    """A picture could not be used."""


class ChartNotFoundError(WheatstoneError, LookupError):
    """The chart was not found in the picture."""


class TooFewError(WheatstoneError, ValueError):
    """Too few points to determine the unknowns of a method."""


class DegenerateError(WheatstoneError, ValueError):
    """The data cannot determine what is asked, however many points there are."""


class FaultyError(WheatstoneError, ValueError):
    """The data have a fault that makes a fit worthless; `code` names it."""


class MismatchError(WheatstoneError, ValueError):
    """A model and the data given to it do not belong together."""


class UnknownNameError(WheatstoneError, ValueError):
    """A name that no method, chart or format has."""


class SettingError(WheatstoneError, ValueError):
    """A setting outside the values that it can take."""


class UnsupportedError(WheatstoneError, ValueError):
    """A format cannot hold what is to be written, or is to be read from it."""


class ArgumentError(WheatstoneError, ValueError):
    """An argument of the wrong shape, type or value."""


class NotComputedError(ArgumentError, AttributeError):
    """A result that was not asked for."""


class CancelledError(WheatstoneError):
    """The work was cancelled."""


class DataWarning(UserWarning):
    """The data have a fault that may make the result worse, or mean something else than meant; or a file that was written
    does not hold the whole model."""


def warn(message: str) -> None:
    """A `DataWarning` at the line that called the package."""
    frame, level = inspect.currentframe(), 1
    while frame is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == __package__:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, DataWarning, stacklevel=level)
