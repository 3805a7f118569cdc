# SPDX-License-Identifier: Apache-2.0
"""gsplat's names of constants."""

from ..._native import operators

ALPHA_THRESHOLD = operators.ALPHA_MIN
MAX_ALPHA = operators.ALPHA_MAX
TRANSMITTANCE_THRESHOLD = operators.TRANSMITTANCE_STOP
