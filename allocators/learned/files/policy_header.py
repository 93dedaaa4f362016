"""The metadata of policy files, read without torch, so that errors are reported before it is imported."""

import os
from pathlib import Path

from safetensors import SafetensorError, safe_open

from alloc.problems import InputError
from alloc.problems.arguments import of_type
from alloc.problems.formats.messages import reason


def read_header(path: Path | str) -> dict[str, str]:
    """Return the metadata of a policy file, unchecked.

    Raises
    ------
    InputError
        If there is no such file, or it is not a safetensors file.
    """
    of_type(path, (str, os.PathLike), "policy")
    source = os.fspath(path)
    if not source:
        raise InputError("names no file; give one by `alloc train`", "policy")
    if os.path.isdir(source):
        raise InputError("is a folder; name a policy file in it", "", source)
    try:
        with safe_open(source, framework="numpy") as file:
            return dict(file.metadata() or {})
    except FileNotFoundError as error:  # raised for files without permission as well
        message = "may not be read; change its permissions" if os.path.exists(source) else "no such policy file"
        raise InputError(message, "", source) from error
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", "", source) from error
    except SafetensorError as error:
        detail = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(f"is not a policy file ({detail}); use one by `alloc train`", "", source) from error
