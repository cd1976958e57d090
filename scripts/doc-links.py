#!/usr/bin/env python3
"""Dead links in the output of `cargo doc`: `doc-links.py FOLDER` names each page, its link and the fault."""

import os
import re
import sys
from functools import cache
from html import unescape
from urllib.parse import unquote

ROOT = os.path.abspath(sys.argv[1])


@cache
def page(path):
    """The links of a page, and its anchors; nothing where there is no such page."""
    if not os.path.isfile(path):
        return None
    with open(path, encoding="utf-8", errors="replace") as file:
        text = file.read()
    links = {unescape(link) for link in re.findall(r'<a\b[^>]*?\shref="([^"]*)"', text)}
    # rustdoc writes some of its anchors with escapes (`impl-From%3CT%3E-for-T`), as its links to them are.
    return links, {unquote(unescape(anchor)) for anchor in re.findall(r'\sid="([^"]*)"', text)}


def missing(origin, link):
    """The fault of a link: the file or the anchor is missing; else None."""
    path, _, anchor = link.partition("#")
    path = unquote(path.partition("?")[0])
    target = os.path.normpath(os.path.join(os.path.dirname(origin), path)) if path else origin
    if os.path.isdir(target):
        target = os.path.join(target, "index.html")
    found = page(target) if target.endswith(".html") else os.path.isfile(target) and (None, None)
    if not found:
        return "no such file"
    # Anchors of lines in source pages (`#12`, `#12-20`) are made by JavaScript, so the page does
    # not contain them.
    is_line = re.fullmatch(r"[\d-]+", anchor) and "/src/" in target
    if anchor and found[1] is not None and not is_line and unquote(anchor) not in found[1]:
        return "no such anchor"
    return None


dead = 0
for folder, _, names in os.walk(ROOT):
    for name in sorted(names):
        path = os.path.join(folder, name)
        # rustdoc's own pages lead to an index of all packages, which it writes on request only.
        if not name.endswith(".html") or (folder == ROOT and name in ("help.html", "settings.html")):
            continue
        for link in sorted(page(path)[0]):
            if re.match(r"[a-z][a-z0-9+.-]*:|//|javascript", link):
                continue
            why = missing(path, link)
            if why:
                dead += 1
                print(f"{os.path.relpath(path, ROOT)}: {link}: {why}")
sys.exit(f"{dead} dead links in {ROOT}" if dead else None)
