# SPDX-License-Identifier: Apache-2.0
"""gsplat's compression in PNG images, which ewa has not: ewa.save writes compressed formats."""


class PngCompression:
    def __init__(self, *args, **kwargs):
        raise NotImplementedError(
            "PngCompression is CUDA-only; ewa.save writes .compressed.ply, .spz and .sog"
        )
