"""Exceptions and warnings, with the codes and positions of the program's messages."""

from __future__ import annotations

import sys
import warnings
from types import FrameType


class _Located(Exception):
    """The code and the position of the fault; None where there is none."""

    code: str | None
    file: str | None
    line: int | None
    column: int | None
    pointer: str | None

    def __init__(
        self,
        message: str,
        *,
        code: str | None = None,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        pointer: str | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.file = file
        self.line = line
        self.column = column
        self.pointer = pointer


class Error(_Located):
    """The base class of all errors of Tumble.

    `code` is that of docs/codes.md (`tumble explain E026`), or None; `file`, `line` and `column`
    say where it is in text, `pointer` where it is in what has no lines: a JSON pointer, an
    archive's member, a table's column and row, or a position in the arguments.

    >>> import tumble
    >>> try:
    ...     tumble.Clip([0.0, 0.0], [[0, 0, 0, 1], [0, 0, 0, 1]])
    ... except tumble.Error as error:
    ...     print(error.code, error.pointer)
    E026 times[0][1]
    """


class InputError(Error, ValueError):
    """A file, an array or an option is invalid.

    >>> import tumble
    >>> issubclass(tumble.InputError, ValueError)
    True
    """


class MissingFileError(InputError, FileNotFoundError):
    """A file does not exist.

    >>> import tumble
    >>> issubclass(tumble.MissingFileError, FileNotFoundError)
    True
    """

    def __str__(self) -> str:
        return str(self.args[0])


class DeviceError(Error, RuntimeError):
    """A device cannot be opened, or has failed.

    >>> import tumble
    >>> issubclass(tumble.DeviceError, RuntimeError)
    True
    """


class OutputError(Error, OSError):
    """A file cannot be written.

    >>> import tumble
    >>> issubclass(tumble.OutputError, OSError)
    True
    """


class InputWarning(_Located, UserWarning):
    """Something in a file is probably a mistake, is not read, or cannot be stored in the format that is written.

    >>> import tumble
    >>> issubclass(tumble.InputWarning, UserWarning)
    True
    """


def warn(warning: InputWarning) -> None:
    """Warns at the line that called the package, in whichever of its functions the warning arises."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and _is_inside(frame):
        frame, level = frame.f_back, level + 1
    warnings.warn(warning, stacklevel=level)


def _is_inside(frame: FrameType) -> bool:
    name: str = frame.f_globals.get("__name__", "")
    return name.partition(".")[0] == __name__.partition(".")[0]
