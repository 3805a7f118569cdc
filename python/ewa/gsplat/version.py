# SPDX-License-Identifier: Apache-2.0
"""The version of gsplat whose API this is."""

__version__ = "1.6.0"
