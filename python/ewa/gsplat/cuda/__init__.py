# SPDX-License-Identifier: Apache-2.0
"""gsplat's name for the lower functions; nothing here needs CUDA."""
