# SPDX-License-Identifier: Apache-2.0
"""gsplat's place of accumulate."""

from .._tiles import accumulate
