"""Directories of results, on file systems and in object stores."""

from __future__ import annotations

import contextlib
import importlib
import os
import shutil
import stat
import tempfile
from collections.abc import Iterable
from typing import Any, Protocol

from tumble.distributed._job import ALL_INPUTS, USAGE, DistributedError, is_url


class Store(Protocol):
    """Files by their names below a directory."""

    def read(self, name: str) -> bytes | None:
        """The whole of a file; None where there is none."""

    def size(self, name: str) -> int | None:
        """How long a file is; None where there is none."""

    def put(self, source: str, name: str) -> None:
        """Makes a file of a local one, whole or not at all."""

    def list(self, below: str = "") -> dict[str, int]:
        """Every file below one of its directories, with its size."""

    def remove(self, below: str) -> None:
        """Removes one of its directories and all in it."""


def store(location: str) -> Store:
    return _Objects(location) if is_url(location) else _Files(location)


def put_text(store: Store, text: str, name: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "text")
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(text)
        store.put(path, name)


def read_text(store: Store, name: str) -> str | None:
    found = store.read(name)
    return None if found is None else found.decode()


class _Files:
    def __init__(self, folder: str) -> None:
        self._folder = folder

    def _path(self, name: str) -> str:
        """Beneath the directory, whatever a manifest says and through whatever links."""
        path = os.path.join(self._folder, name)
        folder = os.path.realpath(self._folder)
        if os.path.commonpath([folder, os.path.realpath(path)]) != folder:
            message = f"{path}: leads out of its directory, which is not followed"
            raise DistributedError(message, ALL_INPUTS)
        return path

    def read(self, name: str) -> bytes | None:
        path = self._path(name)
        try:
            # A pipe or a device may have no end.
            if not stat.S_ISREG(os.stat(path).st_mode):
                return None
            with open(path, "rb") as file:
                return file.read()
        except (FileNotFoundError, NotADirectoryError):
            return None

    def size(self, name: str) -> int | None:
        try:
            return os.path.getsize(self._path(name))
        except OSError:
            return None

    def put(self, source: str, name: str) -> None:
        path = self._path(name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        # The same pattern as the program's temporary files, so that merging removes them.
        number, temporary = tempfile.mkstemp(".part", ".tumble-shard-", os.path.dirname(path))
        try:
            with open(source, "rb") as file, open(number, "wb") as out:
                shutil.copyfileobj(file, out)
                out.flush()
                os.fsync(out.fileno())
            os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, path)
        except BaseException:
            with contextlib.suppress(FileNotFoundError):
                os.remove(temporary)
            raise

    def list(self, below: str = "") -> dict[str, int]:
        found = {}
        for folder, _, names in os.walk(self._path(below)):
            for name in names:
                path = os.path.join(folder, name)
                found[os.path.relpath(path, self._folder)] = os.path.getsize(path)
        return found

    def remove(self, below: str) -> None:
        shutil.rmtree(self._path(below), ignore_errors=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _pyarrow_fs() -> Any:
    try:
        return importlib.import_module("pyarrow.fs")
    except ImportError as error:
        message = "URLs need pyarrow: pip install 'tumble-rotations[ray]'"
        raise DistributedError(message, USAGE) from error


class _Objects:
    def __init__(self, url: str) -> None:
        self._module = _pyarrow_fs()
        try:
            self._file_system, self._base = self._module.FileSystem.from_uri(url)
        except Exception as error:  # pyarrow's own classes are many
            raise DistributedError(f"{url}: {error}", USAGE) from error
        self._base = self._base.rstrip("/")

    def _path(self, name: str) -> str:
        return f"{self._base}/{name}" if name else str(self._base)

    def read(self, name: str) -> bytes | None:
        try:
            with self._file_system.open_input_stream(self._path(name)) as stream:
                found: bytes = stream.read()
                return found
        except FileNotFoundError:
            return None

    def size(self, name: str) -> int | None:
        info = self._file_system.get_file_info(self._path(name))
        return info.size if info.type == self._module.FileType.File else None

    def put(self, source: str, name: str) -> None:
        path = self._path(name)
        # An object exists only after its upload has ended. In a file system, a file gets its final name at the end.
        whole = self._file_system.type_name in ("s3", "gcs", "abfs")
        temporary = path if whole else f"{path}.tumble-{os.getpid()}.part"
        if not whole:
            self._file_system.create_dir(path.rsplit("/", 1)[0], recursive=True)
        with (
            open(source, "rb") as file,
            self._file_system.open_output_stream(temporary) as stream,
        ):
            shutil.copyfileobj(file, stream, 1 << 20)
        if not whole:
            self._file_system.move(temporary, path)

    def list(self, below: str = "") -> dict[str, int]:
        selector = self._module.FileSelector(
            self._path(below), recursive=True, allow_not_found=True
        )
        start = len(str(self._base)) + 1
        return {
            info.path[start:]: info.size
            for info in self._file_system.get_file_info(selector)
            if info.type == self._module.FileType.File
        }

    def remove(self, below: str) -> None:
        with contextlib.suppress(FileNotFoundError):
            self._file_system.delete_dir(self._path(below))

    def fetch(self, name: str, target: str) -> None:
        """Copies an object into a local file."""
        with (
            self._file_system.open_input_stream(self._path(name)) as stream,
            open(target, "wb") as file,
        ):
            shutil.copyfileobj(stream, file, 1 << 20)


def check_names(url: str, names: Iterable[str]) -> None:
    """Objects may be called anything; workers fetch them into files, of which none may lie outside
    their directory."""
    for name in names:
        if any(part in ("", ".", "..") for part in name.split("/")) or "\\" in name:
            message = f"{url}/{name}: is no name of a file below the library; rename the object"
            raise DistributedError(message, USAGE)


def objects(url: str) -> _Objects:
    return _Objects(url)
