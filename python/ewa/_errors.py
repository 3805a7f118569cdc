# SPDX-License-Identifier: Apache-2.0
"""The exceptions of the package. Their text is one line: what is wrong, where, and what would help."""


class InputError(ValueError):
    """Wrong use, or a file that cannot be read."""


class DeviceError(RuntimeError):
    """A Vulkan device is missing or failed, or has too little memory."""


InputError.__module__ = DeviceError.__module__ = "ewa"
