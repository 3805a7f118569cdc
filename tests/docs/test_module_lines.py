#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""scripts/module-lines counts the lines of each module, and finds one with more than it may have."""
import importlib.machinery, importlib.util, pathlib, sys, tempfile, unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True  # no cache beside a script
loader = importlib.machinery.SourceFileLoader("module_lines", str(ROOT / "scripts/module-lines"))
lines = importlib.util.module_from_spec(importlib.util.spec_from_loader("module_lines", loader))
loader.exec_module(lines)

DOCUMENT = """
| Module | Contents | Lines | May include |
|---|---|--:|---|
| `src/cli/` | a | 100 | everything |
| `python/ewa/` | a | 50 | `ewa._native` |
| `python/ewa/gsplat/` | a | 50 | the package, PyTorch |

## Data flow
| `src/other/` | a | 50 | nothing |
"""


class ModuleLines(unittest.TestCase):
    def test_more_lines_than_a_module_may_have_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for path, count in [("src/cli/a.cpp", 60), ("src/cli/a.h", 40), ("src/cli/a.txt", 9), ("python/ewa/a.py", 51), ("python/ewa/gsplat/a.py", 50)]:
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text("int a;\n" * count)
            may = lines.rows_of(DOCUMENT)
            has = lines.lines_of(root, may)
        self.assertNotIn("src/other", may)
        self.assertEqual((may["src/cli"], has["src/cli"], has["python/ewa"], has["python/ewa/gsplat"]), (100, 100, 51, 50))
        found = lines.complaints(may, has)
        self.assertEqual(len(found), 1)
        self.assertIn("python/ewa has 51 lines, 1 more than the 50", found[0])
        self.assertEqual(lines.rows_of(lines.written(DOCUMENT, has))["python/ewa"], 100)
        self.assertEqual(lines.rows_without_lines(DOCUMENT), [])
        self.assertEqual(len(lines.rows_without_lines(DOCUMENT.replace("| 100 |", "| |"))), 1)


if __name__ == "__main__":
    unittest.main()
