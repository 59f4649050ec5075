"""What goes wrong, by the exit codes of the program; the messages are its own."""


class Error(Exception):
    """Anything that Raywright refuses or fails to do."""

    exit_code = 1


class UsageError(Error, ValueError):
    """Something asked for that does not exist: a keyword, a value, a camera, a preset."""

    exit_code = 2


class InputError(Error, ValueError):
    """Content of a scene, model, picture or array that can't be used."""

    exit_code = 3


class FileError(Error, OSError):
    """A file that can't be read or written."""

    exit_code = 4


class LimitError(Error, MemoryError):
    """More than a limit, or the machine, allows."""

    exit_code = 5


for _class in (Error, UsageError, InputError, FileError, LimitError):
    _class.__module__ = "raywright"
