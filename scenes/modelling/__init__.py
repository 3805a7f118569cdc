# SPDX-License-Identifier: Apache-2.0
"""Shapes, textures and the glTF files that the scenes beside this folder are made with. numpy is all they need."""
