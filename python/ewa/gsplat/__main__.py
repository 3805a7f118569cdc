# SPDX-License-Identifier: Apache-2.0
"""python -m ewa.gsplat script.py [argument...]: runs a script whose `gsplat` is ewa.gsplat."""

import importlib.util
import os
import runpy
import sys

from . import install

_USAGE = "usage: python -m ewa.gsplat (script.py | -m module) [argument...]"


def _missing(module):
    """Why no module of this name can be run; None where it can."""
    try:
        spec = importlib.util.find_spec(module)
        if spec is not None and spec.submodule_search_locations is not None:
            spec = importlib.util.find_spec(f"{module}.__main__")
            if spec is None:
                return f"No module named {module}.__main__; {module!r} is a package"
    except (ImportError, ValueError) as error:
        name = getattr(error, "name", None)
        if name is not None and not f"{module}.".startswith(f"{name}."):
            raise  # a package of the path fails by itself
        return f"{module}: {error}"
    return f"No module named {module}" if spec is None else None


def main(arguments):
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_USAGE, file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else 2
    if arguments == ["-m"]:
        print(_USAGE, file=sys.stderr)
        return 2
    if arguments[0] == "-m":
        install()
        sys.argv = arguments[1:]
        sys.path.insert(0, os.getcwd())
        missing = _missing(arguments[1])
        if missing is not None:
            print(missing, file=sys.stderr)
            return 1
        runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
        return 0
    script = arguments[0]
    if not os.path.exists(script):
        print(f"{script}: no such file", file=sys.stderr)
        return 2
    install()
    sys.argv = arguments
    sys.path.insert(0, os.path.dirname(os.path.abspath(script)))
    runpy.run_path(script, run_name="__main__")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
