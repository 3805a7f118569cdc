# SPDX-License-Identifier: Apache-2.0
"""A small ray tracer in numpy and the still life that it photographs."""
