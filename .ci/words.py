#!/usr/bin/env python3
"""Bring the catalogues up to date: what is said in the code is what they hold.

    .venv/bin/python .ci/words.py

Translations stay, new words come without one, and words nobody says any more go. The words of
the page (``_("...")`` in app/) live in handstudio.po, those of errors (both texts of every
`HandstudioError` in handstudio/ and app/) in errors.po.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from io import BytesIO
from pathlib import Path
from string import Formatter
from typing import NamedTuple

from babel.messages.catalog import Catalog
from babel.messages.extract import extract_from_dir
from babel.messages.pofile import read_po, write_po

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("handstudio", "app")
BASE = "HandstudioError"


class Call(NamedTuple):
    """One place in the code where an error is made."""

    where: str
    templates: tuple[str | None, ...]  # None for what is no constant text
    values: frozenset[str | None]  # None for **values


def calls(root: Path = ROOT) -> Iterator[Call]:
    """Every place in the code where an error is made, file by file, from top to bottom."""
    trees = {path: ast.parse(path.read_text("utf-8")) for path in _sources(root)}
    kinds = _kinds(trees.values())
    for path, tree in trees.items():
        constants = _constants(tree)
        found = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
        for node in sorted(found, key=lambda node: (node.lineno, node.col_offset)):
            if _name(node.func) in kinds:
                templates = tuple(_text(each, constants) for each in node.args)
                values = frozenset(keyword.arg for keyword in node.keywords)
                yield Call(f"{path.relative_to(root)}:{node.lineno}", templates, values)


def fields(text: str) -> set[str]:
    """The fields of a template as they are written, format included: {"{seconds:.0f}"}."""
    return {
        f"{{{name}{f'!{conversion}' if conversion else ''}{f':{spec}' if spec else ''}}}"
        for _, name, spec, conversion in Formatter().parse(text)
        if name is not None
    }


def names(text: str) -> set[str]:
    """The values a template names: {"path"} for "{path.name!r}"."""
    return {
        re.split(r"[.\[]", name)[0] for _, name, *_ in Formatter().parse(text) if name is not None
    }


def said_in_errors(root: Path = ROOT) -> list[str]:
    """Both texts of every error, each once."""
    return list(dict.fromkeys(text for call in calls(root) for text in call.templates if text))


def said_on_the_page(root: Path = ROOT) -> list[str]:
    """Everything marked with ``_``, each once."""
    found = extract_from_dir(str(root / "app"), [("**.py", "python")], keywords={"_": None})
    return list(dict.fromkeys(str(message) for _file, _line, message, _comments, _context in found))


DOMAINS = {"handstudio": said_on_the_page, "errors": said_in_errors}


def brought_up_to_date(catalogue: Catalog, said: list[str]) -> Catalog:
    """The same translations for what is said now; the others go."""
    new = Catalog(catalogue.locale)
    for text in said:
        known = catalogue.get(text)
        new.add(text, known.string if known else "")
    return new


def main() -> None:
    """Write every catalogue anew; say what waits for a translation."""
    for domain, said in DOMAINS.items():
        for path in sorted(ROOT.glob(f"app/locale/*/LC_MESSAGES/{domain}.po")):
            header, _, body = path.read_bytes().partition(b"\n\n")
            catalogue = brought_up_to_date(read_po(BytesIO(body)), said())
            with path.open("wb") as file:
                file.write(header + b"\n\n")  # the header stays as it is, and so the diff small
                write_po(file, catalogue, width=100, no_location=True, omit_header=True)
            waiting = [message.id for message in catalogue if message.id and not message.string]
            print(f"{path.relative_to(ROOT)}: {len(catalogue)} texts, {len(waiting)} untranslated")
            print("".join(f"  {text}\n" for text in waiting), end="")


def _sources(root: Path) -> list[Path]:
    return sorted(path for folder in FOLDERS for path in (root / folder).rglob("*.py"))


def _kinds(trees: Iterable[ast.Module]) -> set[str]:
    """The error classes: the base and all that derive from it, wherever they stand."""
    bases = {
        node.name: {_name(base) for base in node.bases}
        for tree in trees
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }
    kinds = {BASE}
    while more := {name for name, above in bases.items() if above & kinds} - kinds:
        kinds |= more
    return kinds


def _constants(tree: ast.Module) -> dict[str, str]:
    """Texts that a file names at its top."""
    return {
        target.id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
        for target in node.targets
        if isinstance(target, ast.Name)
    }


def _name(node: ast.expr) -> str:
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
        case _:
            return ""


def _text(node: ast.expr, constants: dict[str, str]) -> str | None:
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.Name(id=name):
            return constants.get(name)
        case _:
            return None


if __name__ == "__main__":
    main()
