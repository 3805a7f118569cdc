# SPDX-License-Identifier: Apache-2.0
"""gsplat's launcher. One process renders here."""


def cli(fn, args, verbose=False):
    """Calls fn(local_rank, world_rank, world_size, args) as the only process."""
    fn(0, 0, 1, args)
    return True
