# SPDX-License-Identifier: Apache-2.0
"""The exceptions of the package, and the words of their text.

The text is one line: what is wrong, where, and what would help. The extension module calls
`spelled` for each error of libewa, and `wrong_arguments` for each call that fits no signature.
"""

import ast
import difflib
import inspect
import re
import sys


class InputError(ValueError):
    """Wrong use, or a file that cannot be read."""


class DeviceError(RuntimeError):
    """A Vulkan device is missing or failed, or has too little memory."""


InputError.__module__ = DeviceError.__module__ = "ewa"
# Of an exception, Python's inspect knows no signature before 3.13.
for _error in (InputError, DeviceError):
    _arguments = [inspect.Parameter("args", inspect.Parameter.VAR_POSITIONAL)]
    setattr(_error, "__signature__", inspect.Signature(_arguments))

# What libewa advises to users of its programs, and the advice for Python.
_ADVICE = (
    ("-o DIR starts another run, --force replaces this one", "a new Trainer starts anew"),
    ("-o DIR starts another run", "a new Trainer starts anew"),
    ("--force starts anew", "a new Trainer starts anew"),
    ("--resume continues a training run", "Trainer.resume continues from a checkpoint"),
    ("a larger --test-every leaves more of them", "name some as train_frames="),
    ("with --transform move=", "by their means and origin"),
    ("with convert --crop", "with crop"),
    (
        "of the folder of a training run alone, before its splats move or others join them",
        "with dataset= alone",
    ),
    ("ewa cameras searches", "ewa.find_cameras searches"),
    ("ewa mesh makes meshes: ewa mesh IN -o ", "ewa.mesh makes meshes, such as "),
)
# Python's unit of memory is the byte.
_MEMORY = re.compile(
    r"--device-memory \S+ is too little: this needs \S+ or more \((\d+) bytes, not (\d+)\)"
)
_OPTION = re.compile(r"--([a-z][a-z-]*[a-z])(?: (?:(\d[\d.]*(?<!\.))|([a-z]+))(?![\w-]))?")


def spelled(text: str) -> str:
    """An error of libewa with Python's arguments in place of the programs' options.

    `--bands 2` becomes `bands=2`, `--max-splats` becomes `max_splats=`, and `--crop:` becomes `crop:`.
    """
    native = vars(sys.modules["ewa._native"])  # that module imports this one
    names, values = native["_argument_names"], native["_value_words"]
    for words, advice in _ADVICE:
        text = text.replace(words, advice)
    text = _MEMORY.sub(r"device_memory_bytes=\2 is too little: this needs \1 or more", text)

    def argument(found: re.Match[str]) -> str:
        option, number, word = found.groups()
        name = names.get(option, option.replace("-", "_"))
        if found.string.startswith(":", found.end()) and not number and not word:
            return name
        value = number or (f'"{word}"' if word in values else "")
        return f"{name}={value}" + (f" {word}" if word and not value else "")

    return _OPTION.sub(argument, text)


def wrong_arguments(text: str) -> str:
    """One line for a call that fits no signature, from nanobind's text about it."""
    name, _, rest = text.partition("(): incompatible function arguments")
    signatures = re.findall(r"^    \d+\. (.*)$", rest, re.MULTILINE)
    given, keywords = _given(rest.rpartition("Invoked with types: ")[2].strip())
    try:
        function = ast.parse(f"def _{signatures[0]}: ...").body[0]
        assert isinstance(function, ast.FunctionDef)
    except (IndexError, SyntaxError, AssertionError):
        return text.splitlines()[0]
    parameters = _Parameters(function.args)
    if parameters.positional and parameters.positional[0].arg == "self" and given:
        owner = given.pop(0)
        parameters.positional.pop(0)
        name = f"{owner}.{name}".removesuffix(".__init__") if name else f"an attribute of {owner}"
    problem = parameters.unfit(given, keywords)
    if problem is not None:
        return name + problem
    types = ", ".join([*given, *(f"{key}: {kind}" for key, kind in keywords.items())])
    return (
        f"{name} cannot take these arguments ({types}): an element has another type, a number is "
        "too large, or an object was made without its __init__"
    )


def _given(types: str) -> tuple[list[str], dict[str, str]]:
    """The types of positional arguments, and those of keywords, without the names of modules."""
    types, _, keywords = types.partition("kwargs = {")
    named = re.findall(r"(\w+): ([\w.]+)", keywords)
    positional = [t.strip().rpartition(".")[2] for t in types.split(",") if t.strip()]
    return positional, {key: kind.rpartition(".")[2] for key, kind in named}


class _Parameters:
    """The parameters of a signature, and why arguments of some types do not fit it."""

    def __init__(self, arguments: ast.arguments) -> None:
        self.positional = [*arguments.posonlyargs, *arguments.args]
        self.named = arguments.kwonlyargs
        self.required = {
            a.arg for a in self.positional[: len(self.positional) - len(arguments.defaults)]
        }
        self.required |= {a.arg for a, d in zip(self.named, arguments.kw_defaults) if d is None}
        self.required.discard("self")

    def unfit(self, given: list[str], keywords: dict[str, str]) -> str | None:
        known = {a.arg: a for a in (*self.positional, *self.named)}
        for key in keywords:
            if key not in known:
                close = difflib.get_close_matches(key, known, 1)
                return f" has no argument {key}" + (f"; did you mean {close[0]}?" if close else "")
        if len(given) > len(self.positional):
            count = f"{len(self.positional)} argument" + "s" * (len(self.positional) != 1)
            names = f"; the others have names, such as {self.named[0].arg}=" if self.named else ""
            return f" takes {count} by position, not {len(given)}{names}"
        filled = {a.arg: kind for a, kind in zip(self.positional, given)}
        for key in keywords:
            if key in filled:
                return f" has {key} twice: by position and by name"
        filled |= keywords
        missing = [a for a in known if a in self.required and a not in filled]
        if missing:
            return " lacks " + " and ".join(filter(None, (", ".join(missing[:-1]), missing[-1])))
        for key, kind in filled.items():
            wanted = known[key].annotation
            if wanted is not None and not _takes(wanted, kind):
                label = "" if key == "arg" else f": {key}"
                verb = " takes " if key == "arg" else f" is {_a(kind)}; expected "
                tail = f", not {_a(kind)}" if key == "arg" else ""
                return f"{label}{verb}{_readable(wanted)}{tail}"
        return None


def _choices(annotation: ast.expr) -> list[ast.expr]:
    if isinstance(annotation, ast.BinOp):
        return [*_choices(annotation.left), *_choices(annotation.right)]
    return [annotation]


def _base(annotation: ast.expr) -> str:
    """`PathLike` of `os.PathLike[str]`."""
    if isinstance(annotation, ast.Subscript):
        annotation = annotation.value
    return ast.unparse(annotation).rpartition(".")[2]


def _literals(annotation: ast.expr) -> list[object]:
    assert isinstance(annotation, ast.Subscript)
    values = annotation.slice
    parts = values.elts if isinstance(values, ast.Tuple) else [values]
    return [ast.literal_eval(part) for part in parts]


_SCALARS = ("int", "float", "bool", "str", "NoneType")


def _may_be_derived(kind: str) -> bool:
    """Whether a type may be one of the user's, which may be derived from any class."""
    own = vars(sys.modules["ewa._native"])
    return kind[0].isupper() and kind != "NoneType" and kind not in own and "Path" not in kind


def _takes(annotation: ast.expr, kind: str) -> bool:
    """Whether a parameter may take a type. True where the names do not tell."""
    for choice in _choices(annotation):
        base = _base(choice)
        if base[0].isupper() and _may_be_derived(kind):
            return True
        if base in ("object", "ArrayLike", "Any", kind) or (base == "None" and kind == "NoneType"):
            return True
        if base == "int" and re.fullmatch(r"bool|u?int\d+", kind):
            return True
        if base == "float" and re.fullmatch(r"int|bool|u?int\d+|float\d+", kind):
            return True
        if base == "Literal" and kind in {type(value).__name__ for value in _literals(choice)}:
            return True
        if base == "PathLike" and "Path" in kind:
            return True
        if base in ("Sequence", "list", "tuple") and kind not in _SCALARS:
            return True
    return False


def _a(noun: str) -> str:
    if noun == "NoneType":
        return "None"
    return f"{'an' if noun[0] in 'aeiouAEIOU' else 'a'} {noun}"


def _readable(annotation: ast.expr) -> str:
    """`an int or "auto"`"""
    words: list[str] = []
    for choice in _choices(annotation):
        base = _base(choice)
        if base == "Literal":
            words += [
                f'"{value}"' if isinstance(value, str) else str(value)
                for value in _literals(choice)
            ]
        elif base == "Sequence":
            words.append("a sequence")
        elif base == "PathLike":
            words = ["a path" if word == "a str" else word for word in words]
        else:
            words.append("None" if base == "None" else "Splats" if base == "Splats" else _a(base))
    return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))
