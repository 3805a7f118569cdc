#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every pattern of a GoogleTest filter matches a test: those of tests/CMakeLists.txt, tests/fuzz/CMakeLists.txt and
tests/mutation/*.txt, and those that documents and scripts type.

    tests/docs/check_filters.py BUILD

The test programs of BUILD list their tests. A program that is not built, such as the window's, has no filters checked.
"""
import fnmatch, functools, pathlib, re, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def patterns_of(text):
    """The patterns of a filter, those behind a minus too."""
    wanted, _, unwanted = text.partition("-")
    return [pattern for pattern in (wanted + ":" + unwanted).split(":") if pattern]


def filters_of_cmake(text):
    """(program, filter) of each call of ewa_tests and ewa_add_shards. Calls within functions, whose words are variables,
    have none."""
    text = re.sub(r"#.*", "", text)
    variables = dict(re.findall(r"\bset\((\w+) (\S+)\)", text))
    for call, body in re.findall(r"\b(ewa_tests|ewa_add_shards)\(([^()]*)\)", text):
        words = [quoted or word for quoted, word in re.findall(r'"([^"]*)"|(\S+)', body)]
        words = [re.sub(r"\$\{(\w+)\}", lambda found: variables.get(found[1], found[0]), word) for word in words]
        if call == "ewa_tests" and "GROUPS" in words:
            groups = words[words.index("GROUPS") + 1:]
            yield from (("test_" + words[0], groups[i]) for i in range(1, len(groups), 2))
        elif call == "ewa_add_shards" and "${" not in words[3] + words[4]:
            yield words[4].replace("mutant_", "test_"), words[3]


def all_filters():
    """(where, program, filter)"""
    for name in ("tests/CMakeLists.txt", "tests/fuzz/CMakeLists.txt"):
        for program, text in filters_of_cmake((ROOT / name).read_text()):
            yield name, program, text
    for path in sorted((ROOT / "tests/mutation").glob("*.txt")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if heading := re.fullmatch(r"\[(\S+)\] (\S+)", line):
                yield f"tests/mutation/{path.name}:{number}", "test_gpu", heading[2]
    for path in sorted([*(ROOT / "docs").rglob("*.md"), *(ROOT / "scripts").iterdir()]):
        for program, text in re.findall(r"\b(test_\w+)[^\n]* --gtest_filter='?([^' \"$\n]+)", path.read_text()):
            yield str(path.relative_to(ROOT)), program, text


@functools.cache
def tests_of(program):
    """Full names of the tests of a program, or None where it is not built."""
    if not program.exists():
        return None
    listed = subprocess.run([program, "--gtest_list_tests"], check=True, capture_output=True, text=True).stdout
    names, suite = [], ""
    for line in listed.splitlines():
        name = line.split("#")[0].strip()
        if line.startswith("  "):
            names.append(suite + name)
        elif name.endswith("."):
            suite = name
    return names


def main():
    build = pathlib.Path(sys.argv[1])
    dead, count = [], 0
    for where, program, text in all_filters():
        names = tests_of(build / "tests" / program)
        if names is None:
            continue
        for pattern in patterns_of(text):
            count += 1
            if not any(fnmatch.fnmatchcase(name, pattern) for name in names):
                dead.append(f"{where}: {pattern} matches no test of {program}")
    if not count:
        sys.exit(f"{build} has no test programs")
    if dead:
        sys.exit("\n".join(dead))
    print(f"{count} patterns of filters, each with a test")


if __name__ == "__main__":
    main()
