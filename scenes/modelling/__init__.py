"""Shapes, textures and the glTF files that the scenes beside this folder are made with. numpy is all they need."""
