#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks documents and comments: links, anchors, paths of the source tree, long sentences, and words that the glossary replaces.
Checks identifiers for words that mean several things.

    tests/docs/check_words.py [FILE...]     Markdown files and sources; without any: all documents, src, check, include and shaders
    tests/docs/check_words.py --random N    prints N random paragraphs, for a reader to judge

Code does not count as words. Exit status 1 if a check fails.
"""
import pathlib, random, re, sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
MOST_WORDS = 30
BANNED = {  # pattern: what to write
    r"twins?": "CPU reference", r"legs?": "CI job", r"rooms? of": "module", r"forecasts?": "memory estimate",
    r"photograph(s|ed|ing|er|ers)?": "training image, or render", r"posed images?": "image record",
    r"halvings?": "downsample levels", r"left out|lea(ve|ves|ving) out": "skipped", r"look(s|ed|ing)? on": "watch",
    r"go(es|ing)? on|went on": "continue", r"a break|breaks of|unbroken": "mutant, or original", r"anew": "again",
    r"stands?(?! for|.alone)|stood": "is", r"more seldom": "less often", r"laid down": "written", r"there(of|by)|where(of|by)": "of it",
    r"what is so|whoever": "the subject's name", r"arrows? of": "dependency", r"(is|are|being) held(?![- ]out)": "cached, or stored",
}
# Only in comments. The last pattern stands for a sentence without a subject.
BANNED_IN_COMMENTS = {r"told": "printed, sent, or known", r"(?<![^.!?:] )Of(?= )": "the subject's name first"}
# Words of identifiers: the word, the folders where it misleads, and what to write.
BANNED_IN_IDENTIFIERS = (
    (r"told|heard|twins?|legs?", ("src", "check", "include", "shaders", "python/bindings"), "printed, sent, found, or received"),
    (r"pictures?", ("src/gpu", "src/image", "src/operators", "src/passes", "src/pipeline", "src/portions", "src/train", "check/reference", "shaders"),
     "image, render, or part of a view"),
)
SUFFIXES = {".h", ".cpp", ".glsl", ".comp"}
SOURCES = ("src", "check", "include", "shaders", "python/bindings")
WORD = re.compile(r"\w+(?:[-'’.,]\w+)*")
NO_IDENTIFIER = re.compile(r'\'\\?.\'|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.S)
IDENTIFIER = re.compile(r"\b[A-Za-z_]\w*")
WORD_OF_IDENTIFIER = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
SOURCE_PATH = re.compile(r"`((?:src|check|shaders|tests|include|scripts|cmake|docs|examples|scenes)/[\w./-]*)`")


def slug(heading):
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def blocks_of_markdown(text):
    """(line, text) of each paragraph, list item, heading and cell of a table."""
    text = re.sub(r"^```.*?^```", lambda m: "\n" * m.group().count("\n"), text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", lambda m: "\n" * m.group().count("\n"), text, flags=re.S)
    text = re.sub(r"^    .*$", "", text, flags=re.M)
    block, first, heading = [], 1, False
    for number, line in enumerate([*text.splitlines(), ""], 1):
        if block and (heading or re.match(r"\s*(- |\d+\. |#|\||$)", line)):
            yield first, " ".join(block)
            block = []
        heading = line.startswith("#")
        if line.startswith("|"):
            yield from ((number, cell.strip()) for cell in line.strip("|").split("|"))
        elif line.strip():
            first = first if block else number
            block.append(re.sub(r"^\s*(- |\d+\. |#+ )", "", line).strip())


def blocks_of_header(text):
    """(line, text) of each comment. One at the end of a line begins a comment that the next lines may continue."""
    block, first = [], 1
    for number, line in enumerate([*text.splitlines(), ""], 1):
        whole, end = re.match(r"\s*///?(?!/) ?(.*)", line), re.search(r"\S\s+//[/<]* ?(.*)", line)
        if whole and whole.group(1) and "SPDX" not in line:
            first = first if block else number
            block.append(whole.group(1))
            continue
        if block:
            yield first, " ".join(block)
        block, first = ([end.group(1)], number) if end and not whole else ([], number)
    if block:
        yield first, " ".join(block)


def problems_of_identifiers(text, folder):
    """folder: of the source, relative to the root. A snake_case or CamelCase identifier is checked word by word."""
    banned = [(pattern, instead) for pattern, folders, instead in BANNED_IN_IDENTIFIERS if any(folder.is_relative_to(f) for f in folders)]
    code = NO_IDENTIFIER.sub(lambda m: "\n" * m.group().count("\n"), text)
    for number, line in enumerate(code.splitlines() if banned else (), 1):
        for identifier in IDENTIFIER.findall(line):
            for word in WORD_OF_IDENTIFIER.findall(identifier):
                for pattern, instead in banned:
                    if re.fullmatch(pattern, word, re.I):
                        yield f"{number}: '{word}' in {identifier}: write {instead}"


def problems_of(path):
    text = path.read_text()
    markdown = path.suffix == ".md"
    if not markdown and path.is_relative_to(ROOT):
        yield from problems_of_identifiers(text, path.parent.relative_to(ROOT))
    for line, block in (blocks_of_markdown if markdown else blocks_of_header)(text):
        plain = re.sub(r"`[^`]*`", "x", re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", block))
        for sentence in re.split(r"(?<=[.!?:])\W*\s+", plain):
            if (words := len(WORD.findall(sentence))) > MOST_WORDS and (markdown or path.is_relative_to(ROOT / "include")):
                yield f"{line}: {words} words in a sentence: {sentence[:60]}..."
        for pattern, instead in BANNED.items():
            if found := re.search(rf"\b({pattern})\b", plain, re.I):
                yield f"{line}: '{found.group()}': write {instead}"
        for pattern, instead in BANNED_IN_COMMENTS.items() if not markdown else ():
            if found := re.search(pattern, plain):
                yield f"{line}: '{found.group()}': write {instead}"
        for source in SOURCE_PATH.findall(block) if markdown else ():
            if not (ROOT / source).exists():
                yield f"{line}: there is no {source}"
        for target in re.findall(r"\]\((?!\w+:)([^)\s]+)\)", block) if markdown else ():
            name, _, anchor = target.partition("#")
            file = path.parent / name if name else path
            if not file.exists():
                yield f"{line}: broken link: {target}"
            elif anchor and anchor not in map(slug, re.findall(r"^#+ (.*)$", file.read_text(), re.M)):
                yield f"{line}: no heading for {target}"


def check_this_script():
    """Planted words are found, and words of comments, texts and other folders are not."""
    text = 'int told;\nf("picture"); // picture\nclass PictureOfView {};\n/* a\n*/ int of_pictures_, pictured, kPICTURE;\n'
    found = [problem.split(":")[0] for problem in problems_of_identifiers(text, pathlib.PurePath("src/train"))]
    assert found == ["1", "3", "5", "5"], found
    assert len([*problems_of_identifiers(text, pathlib.PurePath("src/viewer"))]) == 1


def main(arguments):
    check_this_script()
    documents = [p for p in sorted(ROOT.rglob("*.md")) if not {"build", "out"} & set(p.relative_to(ROOT).parts)]
    if arguments[:1] == ["--random"]:
        long = [(p, *b) for p in documents for b in blocks_of_markdown(p.read_text()) if len(b[1].split()) > 12]
        for path, line, block in random.Random(15).sample(long, int(arguments[1])):
            print(f"{path.relative_to(ROOT)}:{line}: {block}\n")
        return 0
    sources = [p for folder in SOURCES for p in sorted((ROOT / folder).rglob("*")) if p.suffix in SUFFIXES]
    files = [pathlib.Path(a).resolve() for a in arguments] or documents + sources
    problems = [f"{path.relative_to(ROOT)}:{problem}" for path in files for problem in problems_of(path)]
    print(*problems, f"docs: {len(files)} files, {len(problems)} problems", sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
