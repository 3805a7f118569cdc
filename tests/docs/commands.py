#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a bash script of the commands in the documents' fenced blocks, in the documents' order.

    tests/docs/commands.py [--fast] [FILE...]    without a file: README.md, then docs/*.md by name

A block without a language is bash, "python" is Python; others are skipped. Comments above a block, which a reader does not see:

    <!-- not run: REASON -->               the block is not run
    <!-- not run: `TEXT`: REASON -->       nor are its commands that have this text
    <!-- first: COMMAND -->                runs before the block, in the block's language: what the document takes for granted

--fast leaves out what builds, installs or needs a clone. The commands of a document share a shell, and its Python blocks a
process. The script expects the function `document` and those of scripts/check-docs that it calls.
"""
import pathlib, re, shlex, sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILDS = re.compile(r"^(scripts/|tests/|cmake |cpack |apt|pip |python3 -m venv|build/|PYTHONPATH=)|/pip install")
COMMENT = re.compile(r"<!-- (not run|first): (?:`([^`]*)`: )?(.*?) -->", re.S)


def blocks_of(text):
    """(line, language, body, comments) of each fenced block; comments: (kind, text that a command has, the rest)."""
    comments, fence, body = [], None, []
    lines = text.splitlines()
    number = 0
    while number < len(lines):
        line = lines[number]
        number += 1
        if fence is not None:
            if line.startswith("```"):
                yield fence[0], fence[1], body, comments
                comments, fence, body = [], None, []
            else:
                body.append(line)
        elif line.startswith("```"):
            fence = number, line[3:].strip()
        elif line.startswith("<!--"):
            whole = line
            while "-->" not in whole and number < len(lines):
                whole += "\n" + lines[number]
                number += 1
            if found := COMMENT.fullmatch(whole.strip()):
                comments.append(found.groups())
        elif line.strip():
            comments = []


def commands_of(body):
    """(offset, command): lines without the prompt; a backslash at the end joins the next line. Beside lines with a prompt,
    others are output."""
    whole, start = "", 0
    prompts = any(line.startswith("$ ") for line in body)
    for offset, line in enumerate(body):
        if not whole:
            start = offset
            if prompts and not line.startswith("$ "):
                continue
        whole += line.removeprefix("$ ")
        if line.endswith("\\"):
            whole += "\n"
        elif whole.strip():
            yield start, whole
            whole = ""
        else:
            whole = ""


def call(*words):
    return " ".join(shlex.quote(str(word)) for word in words)


def script_of(path, fast):
    name = path.relative_to(ROOT)
    yield call("document", name)
    for number, language, body, comments in blocks_of(path.read_text()):
        if language not in ("", "bash", "sh", "python"):
            continue
        python = language == "python"
        skips = [(text, reason) for kind, text, reason in comments if kind == "not run"]
        whole = next((reason for text, reason in skips if not text), None)
        firsts = [rest for kind, _, rest in comments if kind == "first"]
        parts = [(0, "\n".join(body))] if python else list(commands_of(body))
        needed = []
        for offset, command in parts:
            place = f"{name}:{number + 1 + offset}"
            reason = whole or next((reason for text, reason in skips if text and text in command), None)
            if not reason and fast and not python and BUILDS.search(command):
                reason = "--fast: it builds, installs or needs a clone"
            shown = command.split("  #")[0].strip() if not python else "Python"
            if reason:
                needed.append(call("skipped", place, shown, reason))
            elif python:
                needed.append(call("python_block", place, command))
            else:
                needed.append(call("execute", place, command))
        if any(not line.startswith("skipped") for line in needed):
            for first in firsts:
                yield call("python_first" if python else "first", f"{name}:{number}", first)
        yield from needed
    yield "end_document"


def main():
    words = sys.argv[1:]
    fast = "--fast" in words
    files = [ROOT / word for word in words if not word.startswith("--")]
    if files and ROOT / "README.md" not in files:  # its session made what the others go on with
        print(call("document", "README.md"), call("first", "README.md", "ewa train photos -o out/photos"), "end_document", sep="\n")
    for path in files or [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        print("\n".join(script_of(path, fast)))


if __name__ == "__main__":
    main()
