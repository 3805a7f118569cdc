#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which commands of a document are run, and that every document's comments are understood."""
import re, unittest

import commands

SAMPLE = """# Title
<!-- first: make it -->
<!-- not run: `other`: needs two -->
```
$ one thing \\
    more          # a remark
what it answers
$ other thing
```
<!-- not run: takes a year -->
```python
wait()
```
<!-- not run: is about no block -->
Text between.
```
scripts/build
```
```json
{}
```
"""


class Commands(unittest.TestCase):
    def script(self, fast=False):
        path = commands.ROOT / "docs/sample.md"
        original, commands.pathlib.Path.read_text = commands.pathlib.Path.read_text, lambda _: SAMPLE
        try:
            return list(commands.script_of(path, fast))
        finally:
            commands.pathlib.Path.read_text = original

    def test_runs_what_is_not_marked(self):
        self.assertEqual(self.script(), [
            "document docs/sample.md",
            "first docs/sample.md:4 'make it'",
            "execute docs/sample.md:5 'one thing \\\n    more          # a remark'",
            "skipped docs/sample.md:8 'other thing' 'needs two'",
            "skipped docs/sample.md:12 Python 'takes a year'",
            "execute docs/sample.md:17 scripts/build",
            "end_document",
        ])

    def test_fast_builds_nothing(self):
        self.assertIn("skipped docs/sample.md:17 scripts/build '--fast: it builds, installs or needs a clone'", self.script(fast=True))

    def test_every_comment_of_the_documents_is_understood(self):
        for path in [commands.ROOT / "README.md", *(commands.ROOT / "docs").glob("*.md")]:
            text = path.read_text()
            used = sum(len(comments) for *_, comments in commands.blocks_of(text))
            self.assertEqual(used, len(re.findall(r"<!-- (?:not run|first):", text)), path)


if __name__ == "__main__":
    unittest.main()
