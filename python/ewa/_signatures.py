# SPDX-License-Identifier: Apache-2.0
"""Signatures of the extension module's functions and classes for Python's inspect."""

import __future__

import inspect
import types
from typing import Any

Native = Any  # a function, a method or a class of the extension module


def signature_of(function: Native) -> inspect.Signature:
    """The signature that nanobind keeps as text, with annotations as text; of the first overload."""
    text, _, defaults = function.__nb_signature__[0]
    names = {f"_{i}": value for i, value in enumerate(defaults or ())}
    definition = text.rpartition("def ")[2].replace("\\", "_")  # "\0" stands for the first default
    name = definition.partition("(")[0]
    flags = __future__.annotations.compiler_flag
    exec(compile(f"def {definition}: ...", "<signature>", "exec", flags), names)
    return inspect.signature(names[name])


def _without_self(signature: inspect.Signature) -> inspect.Signature:
    return signature.replace(parameters=list(signature.parameters.values())[1:])


class _OfClass:
    """The attribute __signature__ of a class: that of its __init__."""

    def __get__(self, instance: object, owner: Native) -> inspect.Signature:
        init = owner.__init__
        if not hasattr(init, "__nb_signature__"):
            if isinstance(init, types.FunctionType):  # of a class that is derived from it
                return _without_self(inspect.signature(init))
            return inspect.Signature()
        return _without_self(signature_of(init)).replace(return_annotation=inspect.Signature.empty)


def add_signatures(module: types.ModuleType) -> None:
    """Gives inspect.signature to all functions, methods and classes of the extension module."""
    members = vars(module)
    for owner in members.values():
        if isinstance(owner, type):
            owner.__signature__ = _OfClass()  # type: ignore[attr-defined]
    method: Native = vars(members["Splats"])["__len__"]
    for kind in (type(members["load"]), type(method)):
        kind.__signature__ = property(signature_of)
    bound: Native = type(method.__get__(0))
    bound.__signature__ = property(lambda one: _without_self(signature_of(one.__func__)))
