#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every option of every command is typed by a test that starts this command.

    tests/docs/check_options.py BUILD [--where]     --where: prints the file that types each option

The programs of BUILD list their options. An option counts for a command if one of these types it, in tests/ or python/tests:

  - a list of words that begins with the command, such as {"render", scene, "--size", "8x8"}
  - the arguments of a helper of tests that starts this command, such as train("out", {"--batch", "2"})
  - a line of a shell script that starts the command
  - a test or a helper that starts this command and no other, such as one whose options are in a table

The first that applies decides. So an option of `ewa train` does not count for the `ewa render` beside it. What a test looks for in
an output does not count. One of the names of an option is enough: -o stands for --output.
"""
import collections, pathlib, re, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
OPTION = re.compile(r"(?<![\w-])(?:--[a-z][a-z0-9-]*|-[a-z](?![\w-]))")
STRING = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'')
# A constant of a file, a function or a test, and a lambda with a name.
CONSTANT = re.compile(r"^(?:inline )?const(?:expr)? [\w:<>\[\] ]+?\b(k[A-Z]\w*)(?:\[\])?( ?(?:= )?\{[^;]*\});", re.M)
FUNCTION = re.compile(r"(?:^ *|[\w>&*] )(\w+)(\((?:[^(){};]|\{[^{}]*\}|\((?:[^()]|\([^()]*\))*\))*\))\s*"
                      r"(?:const|override|:[^{};]*)?\s*\{", re.M)
LAMBDA = re.compile(r"\b(\w+) = \[[^\]]*\]\s*(?:\((?:[^()]|\([^()]*\))*\))?[^;{}]*\{")
# What starts another program than ewa.
PROGRAMS = {"run_view": "ewa-view", "Session": "ewa-view", "EWA_VIEW_PROGRAM": "ewa-view", "kProgram": "ewa-bench",
            "EWA_BENCH_PROGRAM": "ewa-bench"}
SAME = {"bench": "ewa-bench", "ewa-bench": "bench"}  # one function declares the options of both


def options_of(words):
    """The options that the help of a command lists, each with all its names."""
    helps = [subprocess.run([*words, option], capture_output=True, text=True) for option in ("--help", "--help-all")]
    if helps[0].returncode != 0 or ("--help-all" in helps[0].stdout) != (helps[1].returncode == 0):
        sys.exit(f"{' '.join(map(str, words))} --help or --help-all: {helps[0].stderr}{helps[1].stderr}")
    return [OPTION.findall(row) for row in re.findall(r"^  (-.*?)(?:  |$)", helps[-1].stdout or helps[0].stdout, re.M)]


def close_of(text, start):
    """The position behind the bracket that closes the one at `start`. Strings are skipped."""
    depth, at = 0, start
    while at < len(text):
        if text[at] in "([{":
            depth += 1
        elif text[at] in ")]}":
            depth -= 1
            if depth == 0:
                return at + 1
        elif found := STRING.match(text, at):
            at = found.end() - 1
        at += 1
    return len(text)


class Code:
    """C++ or Python: functions and tests by name, with their bodies."""

    def __init__(self, commands):
        self.commands = commands
        first = "|".join(map(re.escape, commands))
        self.begins = re.compile(rf"[({{\[]\s*[\"']({first})[\"'](?=\s*[,)}}\]])")
        self.typed = collections.defaultdict(set)  # command -> options

    def read(self, text, shared):
        """text: of a file; shared: of the headers that it includes."""
        for name, value in CONSTANT.findall(text):
            text = re.sub(rf"(?<!\w){name}\b(?! ?(?:= ?)?\{{)", lambda _: value.lstrip(" ="), text)
        bodies = list(self.bodies(text))
        helpers = self.helpers(bodies + list(self.bodies(shared)))
        for _, body in bodies:
            self.read_body(body, helpers)

    @staticmethod
    def bodies(text):
        """(name, text) of each test and function; those of Python go on to the next."""
        if re.search(r"^(def|import|from) ", text, re.M):
            for found in re.finditer(r"^ *def (\w+)\(.*?(?=^ *def |\Z)|^(?=\S)(?!def |class |@)(\w+).*?$", text, re.M | re.S):
                yield found[1] or "", found[0]
            return
        for found in FUNCTION.finditer(text):
            if found[1] not in ("if", "for", "while", "switch", "catch"):
                yield found[1], text[found.end() - 1 : close_of(text, found.end() - 1)]

    def helpers(self, bodies, known=None):
        """name -> commands that the helper starts, itself or through another. known: those of the file, for lambdas of a test."""
        started = {**(known or {name: {program} for name, program in PROGRAMS.items()})}
        for name, _ in bodies if known else ():
            started[name] = set()
        for name, body in bodies:
            if name and not name.startswith("TEST") and not name.startswith("test_"):
                started.setdefault(name, set()).update(self.begins.findall(body))
        while True:
            before = sum(map(len, started.values()))
            for name, body in bodies:
                if name in started:
                    for word in self.called(body, started):
                        started[name] |= started[word]
            if sum(map(len, started.values())) == before:
                return {name: found for name, found in started.items() if found}

    @staticmethod
    def called(body, helpers):
        calls = set(re.findall(r"\b(\w+)(?: \w+)?\(", body))
        return (calls & helpers.keys()) | (PROGRAMS.keys() & set(re.findall(r"\w+", body)))

    def read_body(self, body, helpers):
        lambdas = [(found[1], body[found.end() - 1 : close_of(body, found.end() - 1)]) for found in LAMBDA.finditer(body)]
        if lambdas:
            helpers = self.helpers(lambdas, helpers)
        started = set(self.begins.findall(body))
        for word in self.called(body, helpers):
            started |= helpers[word]
        # Lists that begin with a command, then calls of helpers, the innermost first; what is read is blanked.
        for find in (self.begins, re.compile(rf"\b({'|'.join(helpers)})(?: \w+)?(?=\()")):
            for found in reversed(list(find.finditer(body))):
                start = found.start() if find is self.begins else found.end()
                end = close_of(body, start)
                region = body[start:end]
                for command in {found[1]} if find is self.begins else helpers[found[1]]:
                    self.count(command, region)
                body = body[:start] + re.sub(r"[\"'](?=-)", " ", region) + body[end:]
        if len(started) == 1:
            self.count(started.pop(), body)

    def count(self, command, text):
        text = re.sub(r"\b(?:r?find|contains|starts_with|assertIn|assertNotIn)\(\s*[\"'][^\n]*", " ", text)
        for found in STRING.finditer(text):
            word = found[0][1:-1].strip()
            if command == "ewa-bench" and word.startswith("--"):
                self.typed[command].update(OPTION.findall(word))
            elif option := re.fullmatch(rf"({OPTION.pattern})(=\S*)?", word, re.S):
                self.typed[command].add(option[1])


def read_shell(text, commands, typed):
    """Adds what each line types. A function that starts a command makes its name one that does."""
    text = re.sub(r"\\\n", " ", text)
    names = {name: command for name, body in re.findall(r"^(\w+)\(\) \{(.*?)\}", text, re.M | re.S)
             if not name.startswith("row_") and (found := re.search(r"\bewa (\w+)\b", body)) and (command := found[1]) in commands}
    for line in text.splitlines():
        for part in re.split(r"&&|\|\||[;|]", line):
            for program, word in re.findall(r"(?:^|[\s\"/(])(ewa|ewa-view|ewa-bench|\w+)(?=\"?\s|$)\"?(?: (\w+))?", part):
                command = word if program == "ewa" else names.get(program, program)
                if command in commands:
                    typed[command].update(OPTION.findall(part))


def included(text, seen):
    """The text of the headers of tests that a text includes, and of those that these include."""
    whole = ""
    for name in re.findall(r'#include "([\w/.]+)"', text):
        path = ROOT / "tests" / name
        if name not in seen and path.exists():
            seen.add(name)
            own = without_comments(path.read_text())
            whole += own + included(own, seen)
    return whole


def without_comments(text):
    return re.sub(r"^\s*(?://|#(?!include|define|if|endif)).*$|\s//[^\"\n]*$", "", text, flags=re.M)


def commands_of(build):
    """name -> the words that start it"""
    shown = subprocess.run([build / "ewa", "--help"], check=True, capture_output=True, text=True).stdout
    commands = {name: [build / "ewa", name] for name in re.findall(r"^  (\w+)  ", shown.partition("Subcommands:")[2], re.M)}
    commands.update({name: [build / name] for name in ("ewa-view", "ewa-bench") if (build / name).exists()})
    return commands


def read_tests(commands):
    """(command, option) -> the files that type it"""
    where = collections.defaultdict(set)
    for path in sorted(p for folder in ("tests", "python/tests") for p in (ROOT / folder).rglob("*") if p.is_file()):
        code = Code([*commands])
        if path.suffix in (".cpp", ".h", ".py") and path != pathlib.Path(__file__):
            text = path.read_text()
            code.read(without_comments(text), included(text, set()))
        elif path.suffix == ".sh" or (not path.suffix and path.read_bytes().startswith(b"#!") and b"sh" in path.read_bytes()[:30]):
            read_shell(path.read_text(), commands, code.typed)
        for command, options in code.typed.items():
            for option in options:
                where[command, option].add(str(path.relative_to(ROOT)))
    return where


def main():
    commands = commands_of(pathlib.Path(sys.argv[1]))
    where = read_tests(commands)
    missing = count = 0
    for command, words in commands.items():
        same = SAME.get(command, command)
        for names in options_of(words):
            count += 1
            files = sorted({file for name in names for file in where[command, name] | where[same, name]})
            if names[-1] in ("--help", "--help-all"):
                files.append(pathlib.Path(__file__).name)  # options_of
            if "--where" in sys.argv:
                print(command, ", ".join(names) + ":", *files)
            if not files:
                missing += 1
                print(f"{command} {', '.join(names)}: no test types it", file=sys.stderr)
    if missing:
        sys.exit(f"{missing} of {count} options have no test")
    print(f"{count} options, each typed by a test of its command")


if __name__ == "__main__":
    main()
