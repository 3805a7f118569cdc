# SPDX-License-Identifier: Apache-2.0
"""The version of gsplat whose return values the functions have."""

from ._arguments import check

_versions = ("1.4", "1.5", "1.6")
_current = "1.6"


def dialect(version: str | None = None) -> str:
    """Chooses the return values of gsplat 1.4, 1.5 or 1.6 (the default) and returns the choice.

    1.4: radii are one number a splat, and packed projection returns no batch ids.
    1.4 and 1.5: packed projection returns no `indptr`.
    """
    global _current
    if version is not None:
        check(version in _versions, f"dialect {version!r} is none of {', '.join(_versions)}")
        _current = version
    return _current


def radii_of(radii):
    """Radii [..., 2] in the form of the dialect."""
    return radii.amax(-1) if _current == "1.4" else radii
