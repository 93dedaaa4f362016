"""What a policy file says of itself; read without torch, so that mistakes are told before it is loaded."""

import os
from pathlib import Path

from safetensors import SafetensorError, safe_open

from alloc.problems import InputError
from alloc.problems.arguments import of_type
from alloc.problems.formats.files import reason as words


def read_header(path: Path | str) -> dict[str, str]:
    """Return the description in a policy file, unchecked.

    Raises
    ------
    InputError
        If there is no such file, or it is none of safetensors.
    """
    source = os.fspath(of_type(path, (str, os.PathLike), "policy"))
    if not source:
        raise InputError("names no file; give one by `alloc train`", "policy")
    if os.path.isdir(source):
        raise InputError("is a folder; name a policy file in it", "", source)
    try:
        with safe_open(source, framework="numpy") as file:
            return dict(file.metadata() or {})
    except FileNotFoundError as error:  # said of files that may not be read as well
        reason = "may not be read; change its permissions" if os.path.exists(source) else "no such policy file"
        raise InputError(reason, "", source) from error
    except OSError as error:
        raise InputError(f"cannot be read: {words(error)}", "", source) from error
    except SafetensorError as error:
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(f"is not a policy file ({reason}); use one by `alloc train`", "", source) from error
