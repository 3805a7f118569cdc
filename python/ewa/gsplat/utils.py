# SPDX-License-Identifier: Apache-2.0
"""gsplat's place of small tools."""

from ._geometry import normalized_quat_to_rotmat
