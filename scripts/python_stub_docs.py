#!/usr/bin/env python3
"""Writes the first paragraph of each docstring of the Python package into its stubs, because editors show the text of the
stubs.

    target/python/bin/python scripts/python_stub_docs.py

`python/tests/test_docs.py` compares the stubs with the package.
"""

from __future__ import annotations

import ast
import pathlib
from collections.abc import Callable, Iterator

STUBS = pathlib.Path(__file__).parent.parent / "python" / "package" / "tumble" / "_tumble.pyi"

Definition = ast.FunctionDef | ast.ClassDef


def definitions(nodes: list[ast.stmt], prefix: str = "") -> Iterator[tuple[str, Definition]]:
    """Classes and functions by their names, such as `Clip.evaluate`."""
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield prefix + node.name, node
        if isinstance(node, ast.ClassDef):
            yield from definitions(node.body, f"{prefix}{node.name}.")


def with_docs(text: str, described: Callable[[str], str | None]) -> str:
    """The stubs, in which each name that `described` knows has its text. Of overloads, the first one has it."""
    lines = text.splitlines()
    first: dict[str, Definition] = {}
    for name, node in definitions(ast.parse(text).body):
        first.setdefault(name, node)
    # From the end, so that line numbers stay valid; the members of a class before the class.
    for name, node in sorted(first.items(), key=lambda entry: -entry[1].lineno):
        paragraph = described(name)
        if paragraph is None:
            continue
        indent = " " * (node.col_offset + 4)
        docstring = [indent + line for line in f'"""{paragraph}"""'.splitlines()]
        body = node.body[0]
        start, end = body.lineno - 1, body.end_lineno or body.lineno
        if ast.get_docstring(node) is not None:
            lines[start:end] = docstring
        elif isinstance(body, ast.Expr):
            lines[start] = lines[start].removesuffix(" ...")
            lines[start + 1 : start + 1] = docstring
        else:
            header = next(i for i in range(node.lineno - 1, len(lines)) if lines[i].endswith(":"))
            lines[header + 1 : header + 1] = docstring
    return "\n".join(lines) + "\n"


def first_paragraph(name: str) -> str | None:
    """The first paragraph of the docstring of a public name."""
    import inspect

    import tumble

    value: object = tumble
    for index, part in enumerate(name.split(".")):
        if part.startswith("_") or index == 0 and part not in tumble.__all__:
            return None
        value = getattr(value, part, None)
    docstring = inspect.getdoc(value)
    return None if docstring is None else docstring.split("\n\n")[0]


if __name__ == "__main__":
    STUBS.write_text(with_docs(STUBS.read_text(encoding="utf-8"), first_paragraph), encoding="utf-8")
