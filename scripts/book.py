#!/usr/bin/env python3
"""Prepares pages that are read in the repository too for mdBook.

    mdbook build                       calls it for each chapter (book.toml)
    scripts/book.py check target/book  finds links that lead nowhere in the finished book

The chapters that lie above docs/ get places in the book, and links to them follow. A link to a file
that is no page, such as a source, becomes its text.
"""

import html.parser
import json
import pathlib
import posixpath
import re
import sys
import urllib.parse

# A link whose text may have code in it, or code that may look like one. The alternatives in a link's text exclude each
# other: otherwise a bracket before much code, which is no link, takes time that grows as a power of two.
LINK_OR_CODE = re.compile(r"```.*?```|`[^`\n]*`(?!\])|(!?)\[((?:`[^`]*`|[^\[\]`])*)\]\(([^()\s]+)\)", re.DOTALL)


def chapters(items):
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            yield item["Chapter"]
            yield from chapters(item["Chapter"]["sub_items"])


def page_of(source):
    """Where the book has a page, from where docs/ has it."""
    if source == "../README.md":
        return "index.md"
    return posixpath.basename(source).lower()


def rewritten(text, folder, pages):
    """A chapter that lies in a folder as seen from docs/, with links as the book has them."""

    def link(match):
        image, label, target = match.groups()
        if target is None or "://" in target or target.startswith("#"):
            return match[0]
        path, _, anchor = target.partition("#")
        # From a page above docs/, `docs/x.md` is x.md.
        path = posixpath.relpath(posixpath.join("docs", folder, path), "docs")
        if path in pages:
            path = pages[path] + (f"#{anchor}" if anchor else "")
        elif path.startswith("../") or path == "SUMMARY.md":
            return label
        return f"{image}[{label}]({path})"

    return LINK_OR_CODE.sub(link, text)


def preprocess():
    _, book = json.load(sys.stdin)
    items = book["items"] if "items" in book else book["sections"]
    found = [chapter for chapter in chapters(items) if chapter["path"]]
    pages = {chapter["source_path"]: page_of(chapter["source_path"]) for chapter in found}
    if len(set(pages.values())) < len(pages):
        sys.exit("two chapters of docs/SUMMARY.md would have one name in the book")
    for chapter in found:
        source = chapter["source_path"]
        chapter["content"] = rewritten(chapter["content"], posixpath.dirname(source), pages)
        chapter["path"] = pages[source]
    json.dump(book, sys.stdout)


class Page(html.parser.HTMLParser):
    """The names in a page and the links out of it."""

    def __init__(self, text):
        super().__init__()
        self.names, self.links = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("id", "name") and value:
                self.names.add(value)
            elif name in ("href", "src") and value and tag in ("a", "img"):
                self.links.append(value)


def check(folder):
    # print.html has all chapters again; toc.html is a frame of every page.
    paths = [path for path in sorted(folder.glob("*.html")) if path.name not in ("print.html", "toc.html")]
    pages = {path.name: Page(path.read_text()) for path in paths}
    links, dead = 0, []
    for name, page in pages.items():
        for link in page.links:
            if "://" in link or link.startswith(("data:", "mailto:")):
                continue
            links += 1
            path, _, anchor = urllib.parse.unquote(link).partition("#")
            target = path or name
            if target in pages:
                if anchor and anchor not in pages[target].names:
                    dead.append(f"{name}: {link}: the page has no such heading")
            elif not (folder / target).is_file():
                dead.append(f"{name}: {link}: there is no such page")
    if dead:
        sys.exit("\n".join(dead))
    if links < 200:
        sys.exit(f"only {links} links were found in {folder}")
    for name in ("index.html", "architecture.html"):
        linked = {link.partition("#")[0] for link in pages[name].links} & pages.keys()
        if len(linked) < 10:
            sys.exit(f"{name} leads to {len(linked)} pages only: the links of a page above docs/ were lost")
    print(f"{len(pages)} pages, {links} links, none of them dead: {folder}/index.html")


match sys.argv[1:]:
    case []:
        preprocess()
    case ["supports", _]:
        pass
    case ["check", folder]:
        check(pathlib.Path(folder))
    case _:
        sys.exit(__doc__)
