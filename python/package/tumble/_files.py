"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator


@contextlib.contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[str]:
    """The name under which a file is written; at the end it takes the name `path`. Where writing it fails or is
    interrupted, what was there before stays."""
    final = os.fspath(path)
    partial = f"{final}.{os.getpid()}.partial"
    try:
        yield partial
        os.replace(partial, final)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(partial)
        raise
