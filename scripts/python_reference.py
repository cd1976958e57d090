#!/usr/bin/env python3
"""Writes docs/python-reference.md: every public name of the Python package, with its docstring.

    target/python/bin/python scripts/python_reference.py > docs/python-reference.md

`python/tests/test_docs.py` compares the page with the package.
"""

from __future__ import annotations

import inspect
import re
import types

import tumble

HEAD = """# Python reference

Every public name of the package `tumble`, from its docstrings. [The Python package](python.md) is the guide. In a session,
`help(tumble.Engine.evaluate)` prints the same text. Wrong arguments raise `InputError`, failing devices `DeviceError`, and files that
cannot be written `OutputError`; all are of the class `tumble.Error`.

<!-- written by scripts/python_reference.py -->
"""


def signature(name, value):
    """How a function is called, without types and without the object itself."""
    try:
        found = inspect.signature(value)
    except (TypeError, ValueError):
        return f"{name}(…)"
    parameters = [p.replace(annotation=p.empty) for p in found.parameters.values() if p.name not in ("self", "cls", "$self")]
    return f"{name}{found.replace(parameters=parameters, return_annotation=found.empty)}"


def prose(text):
    """A paragraph as Markdown: what looks like a tag or a link outside of code is text."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if part.startswith("`") else part.replace("<", "&lt;").replace("](", "] (") for part in parts)


def described(text):
    """A docstring as Markdown, with its examples as code."""
    lines: list[str] = []
    is_example = False
    for line in text.splitlines():
        if line.startswith(">>>") and not is_example:
            lines += ["```pycon"]
            is_example = True
        if is_example and not line.strip():
            lines += ["```"]
            is_example = False
        lines.append(line if is_example else prose(line))
    if is_example:
        lines.append("```")
    return "\n".join(lines) + "\n"


def members(kind):
    """Methods and properties that a class documents itself, by name."""
    for name, member in sorted(vars(kind).items()):
        if not name.startswith("_") and inspect.getdoc(member):
            yield name, member


def of_function(level, name, value):
    return f"{level} `{name}`\n\n```python\n{signature(name.rpartition('.')[2], value)}\n```\n\n{described(inspect.getdoc(value))}\n"


def of_class(name, kind):
    text = f"## `{name}`\n\n{described(inspect.getdoc(kind) or '')}\n"
    for short, member in members(kind):
        member_name = f"{name}.{short}"
        is_call = callable(member) or isinstance(member, (classmethod, staticmethod))
        if is_call:
            text += of_function("###", member_name, getattr(kind, short))
        else:
            text += f"### `{member_name}`\n\n{described(inspect.getdoc(member))}\n"
    return text


def page():
    values = {name: getattr(tumble, name) for name in sorted(tumble.__all__)}
    functions = {name: value for name, value in values.items() if callable(value) and not inspect.isclass(value)}
    text = HEAD + "\n## Functions\n\n"
    first_names: dict[int, str] = {}  # of each function, by its identity
    for name, value in functions.items():
        first = first_names.setdefault(id(value), name)
        if first == name:
            text += of_function("###", f"tumble.{name}", value)
        else:
            text += f"### `tumble.{name}`\n\nThe same function as [`tumble.{first}`](#tumble{first}).\n\n"
    for name, value in values.items():
        if inspect.isclass(value):
            text += of_class(f"tumble.{name}", value)
    for name, value in values.items():
        if isinstance(value, types.ModuleType):
            text += f"## `tumble.{name}`\n\n{described(inspect.getdoc(value) or '')}\n"
            for short in value.__all__:
                text += of_function("###", f"tumble.{name}.{short}", getattr(value, short))
    return text.rstrip("\n") + "\n"


if __name__ == "__main__":
    print(page(), end="")
