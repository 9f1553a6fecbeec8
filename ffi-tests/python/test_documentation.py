"""The documentation: its Python runs, its commands have arguments that exist, its links lead somewhere.

The blocks of C and C++ are compiled by ffi-tests/readme, those of Rust by the doc tests of src/lib.rs.
"""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import made
import numpy as np
import pytest
import skep

ROOT = Path(__file__).parents[2]
# What a checkout may hold beside the project's own files.
FOREIGN = {"target", "build", "node_modules", ".git"}
PAGES = sorted(page for page in ROOT.rglob("*.md") if not FOREIGN & set(page.relative_to(ROOT).parts))
# A fence, the words behind it, and the block; blocks in lists are indented.
BLOCK = re.compile(r"^( *)```([^\n]*)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(?<!\\)\[(?:[^\]\[]|\[[^\]]*\])*\]\(([^)\s]+)\)")
ARGUMENTS_AFTER = "--"


class Block(NamedTuple):
    """A block of code of a page."""

    info: str
    code: str
    line: int
    """The line of the page that is before the code."""


def blocks(page: Path, language: str) -> list[Block]:
    """The blocks of a page in a language, which is the first word behind the fence."""
    text, found = page.read_text(), []
    for match in BLOCK.finditer(text):
        indent, info, code = match.groups()
        if re.split(r"[ ,]", info)[0] == language:
            lines = [line.removeprefix(indent) for line in code.splitlines()]
            found.append(Block(info, "\n".join(lines), text[: match.start(3)].count("\n")))
    return found


def with_blocks(language: str) -> list[Any]:
    """The pages with blocks in a language, as parameters of a test."""
    pages = (page for page in PAGES if blocks(page, language))
    return [pytest.param(page, id=str(page.relative_to(ROOT))) for page in pages]


def run(page: Path, names: dict[str, Any]) -> None:
    """Runs the blocks of a page one after the other; those marked `no_run`, which need other programs or
    machines, are compiled only.
    """
    for block in blocks(page, "python"):
        # The line numbers of errors are those of the page.
        compiled = compile("\n" * block.line + block.code, str(page), "exec")
        if "no_run" not in block.info:
            exec(compiled, names)


@pytest.mark.parametrize("page", with_blocks("python"))
def test_python_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made.scene_folder(tmp_path / "SCENE")
    monkeypatch.chdir(tmp_path)
    taken = made.photographs()
    names: dict[str, Any] = {
        "__name__": "documentation",
        "photographs": [photograph.image for photograph in taken],
        "cameras": [(p.camera.K, p.camera.R, p.camera.t) for p in taken],
    }
    run(page, names)
    if page == ROOT / "README.md":
        validated = names["why_empty"] == 0
        assert validated.mean() > 0.5
        assert np.median(np.abs(names["depth"] / taken[0].depth - 1)[validated]) < 0.005
        assert len(names["positions"]) == len(names["colors"]) > 1000


def commands(block: Block) -> Iterator[list[str]]:
    """The simple commands of a block of a shell, without variables that are set for them."""
    for line in block.code.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(line, posix=True, punctuation_chars=";&|")
        lexer.whitespace_split = True
        words: list[str] = []
        for word in [*lexer, ";"]:
            if set(word) <= set(";&|"):
                while words and re.match(r"\w+=", words[0]):
                    del words[0]
                if words:
                    yield words
                words = []
            else:
                words.append(word)


def all_commands() -> Iterator[tuple[str, list[str]]]:
    for page in PAGES:
        for block in blocks(page, "sh"):
            for words in commands(block):
                yield f"{page.relative_to(ROOT)}: {' '.join(words)}", words


def arguments_of_skep(words: list[str]) -> list[str] | None:
    """What is behind the program's name; None for other programs."""
    if words[0].rpartition("/")[2] == "skep":
        return words[1:]
    if words[:2] == ["cargo", "run"] and "--example" not in words:
        return words[words.index(ARGUMENTS_AFTER) + 1 :]
    return None


def test_commands_of_skep_have_arguments_that_exist(program: str) -> None:
    """The program checks each argument before it comes to `--help`."""
    checked, seen = 0, set()
    for where, words in all_commands():
        arguments = arguments_of_skep(words)
        if arguments is None or tuple(arguments) in seen:
            continue
        seen.add(tuple(arguments))
        parts = [arguments]
        if ARGUMENTS_AFTER in arguments:
            # `skep evaluate` hands the rest on to `skep reconstruct`.
            at = arguments.index(ARGUMENTS_AFTER)
            parts = [arguments[:at], ["reconstruct", "SCENE", *arguments[at + 1 :]]]
        for part in parts:
            # `skep help COMMAND` takes no argument.
            asked = part if part[0] == "help" else [*part, "--help"]
            answer = subprocess.run([program, *asked], capture_output=True, text=True)
            assert answer.returncode == 0, f"{where}\n{answer.stderr}"
            checked += 1
    assert checked > 40


def test_options_that_are_set_exist() -> None:
    settings = [
        (page, setting)
        for page in PAGES
        for setting in re.findall(r"--set ([a-z_.]+=[\w.,:-]+)", page.read_text())
        # What a page of changes tells of earlier versions may be gone.
        if page.name != "CHANGELOG.md"
    ]
    assert len(settings) > 3
    for page, setting in settings:
        name, _, value = setting.rstrip(".,:").partition("=")
        try:
            skep.Options()[name] = value
        except skep.Error as error:
            pytest.fail(f"{page.relative_to(ROOT)}: --set {setting}: {error}")


def test_tests_benchmarks_and_scripts_that_are_named_exist() -> None:
    manifest = (ROOT / "Cargo.toml").read_text()
    folders = {"--bench": "benches", "--test": "tests", "--example": "examples/rust"}
    for where, words in all_commands():
        for kind, name in zip(words, words[1:]):
            if kind in folders and words[0] == "cargo":
                folder = ROOT / folders[kind]
                assert (folder / f"{name}.rs").is_file() or (folder / name / "main.rs").is_file(), where
            if kind == "--features" and words[0] == "cargo":
                for feature in name.split(","):
                    assert re.search(rf"^{feature} = ", manifest, re.MULTILINE), where
        for word in words:
            # Runs make `dense`.
            if word.startswith(("ffi-tests/", "src/", "examples/")) and not word.endswith("/dense"):
                assert (ROOT / word).exists(), where


def anchors(page: Path) -> set[str]:
    """The anchors of the headings of a page, as GitHub makes them."""
    found: set[str] = set()
    for heading in re.findall(r"^#+ (.*)$", BLOCK.sub("", page.read_text()), re.MULTILINE):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        anchor = re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")
        count, taken = 0, anchor
        while taken in found:
            count += 1
            taken = f"{anchor}-{count}"
        found.add(taken)
    return found


def links(page: Path) -> list[str]:
    """The targets of the links of a page, also of those to pictures, but for those on the web and into the
    Rust documentation, which `cargo doc` checks.
    """
    text = re.sub(r"`[^`\n]*`(?!\])", "", BLOCK.sub("", page.read_text()))
    found = [link for link in LINK.findall(text) if "://" not in link and not link.startswith("crate::")]
    return [*found, *re.findall(r'<img[^>]* src="([^":]+)"', text)]


def test_links_lead_to_files_and_headings() -> None:
    dead, count = [], 0
    for page in PAGES:
        for link in links(page):
            path, _, anchor = link.partition("#")
            target = (page.parent / path).resolve() if path else page
            count += 1
            if not target.exists() or ROOT not in target.parents:
                dead.append(f"{page.relative_to(ROOT)}: {link}: no such file")
            elif anchor and anchor not in anchors(target):
                dead.append(f"{page.relative_to(ROOT)}: {link}: no such heading")
    assert not dead, "\n".join(dead)
    assert count > 100


def test_the_index_lists_every_page() -> None:
    index = ROOT / "docs/README.md"
    listed = {(index.parent / link.partition("#")[0]).resolve() for link in links(index)}
    missing = {page for page in (ROOT / "docs").glob("*.md")} - listed - {index}
    assert not missing, f"docs/README.md does not list {missing}"
    pictures = {file for file in (ROOT / "docs").iterdir() if file.suffix in (".jpg", ".png", ".svg")}
    shown = {(page.parent / link).resolve() for page in PAGES for link in links(page) if "#" not in link}
    # Some are part of the Rust documentation.
    in_rust = re.findall(r"docs/(\S+\.svg)", (ROOT / "src/lib.rs").read_text())
    shown |= {ROOT / "docs" / name for name in in_rust}
    assert pictures <= shown, f"no page shows {pictures - shown}"


def test_pages_with_rust_are_doc_tests() -> None:
    source = (ROOT / "src/lib.rs").read_text()
    for page in PAGES:
        if blocks(page, "rust"):
            assert f'include_str!("../{page.relative_to(ROOT)}")' in source, page
