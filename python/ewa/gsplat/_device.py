# SPDX-License-Identifier: Apache-2.0
"""The operators of the extension module, loaded when they are first used."""

import importlib

_operators = None


def operators():
    global _operators
    if _operators is None:
        _operators = importlib.import_module("ewa._native").operators
    return _operators
