"""Failures of libraries that a user's files or machine cause, and the one line that tells each of them."""

import os

from er_il.support.errors import ErIlError

REPORT = "This looks like a bug of er_il: please report it on its issues page, with these lines and `er-il doctor`'s."

# Exceptions by module and name, since importing what defines them takes seconds, and what has not been imported has
# raised nothing. Only those that speak of data: a KeyError or a TypeError may be our own mistake.
_OF_DATA = {
    "av.error.FFmpegError",
    "datasets.exceptions.DatasetsError",
    "draccus.utils.DraccusException",
    "huggingface_hub.errors.HFValidationError",
    "httpx.HTTPError",
    "json.decoder.JSONDecodeError",
    "pandas.errors.ParserError",
    "PIL.UnidentifiedImageError",
    "pyarrow.lib.ArrowInvalid",
    "safetensors._safetensors_rust.SafetensorError",
    "builtins.UnicodeDecodeError",
    "yaml.error.YAMLError",
    "zipfile.BadZipFile",
    "zlib.error",
}
_OF_WORKERS = "concurrent.futures._base.BrokenExecutor"


def explanation(error: BaseException) -> str | None:
    """The line that tells a user's mistake, such as a damaged file or a full disk; None if it may be a bug."""
    if isinstance(error, ErIlError):
        return _line(str(error))
    if isinstance(error, OSError) and error.errno is not None:
        reason = error.strerror or os.strerror(error.errno)
        return _line(": ".join(map(str, filter(None, (reason, error.filename)))))
    if isinstance(error, MemoryError):
        return "There is not enough memory."
    names = {f"{kind.__module__}.{kind.__qualname__}" for kind in type(error).__mro__}
    if _OF_WORKERS in names and "SIGKILL" in str(error):
        return "A worker process was killed, as the system does when memory runs out. Run the command again."
    # Arrow and the hub raise plain OSErrors without a number for files and answers that they cannot read.
    if names & _OF_DATA or isinstance(error, OSError):
        return f"A file cannot be read ({type(error).__name__}): {_line(str(error))}"
    return None


def _line(text: str) -> str:
    """Text as one line for a terminal: names in the files of others may hold line breaks and control characters."""
    return "".join(each if each.isprintable() else " " for each in " ".join(text.split()))
