# SPDX-License-Identifier: Apache-2.0
"""Uses an installed wheel of the Python package: files always, renders unless the argument is "files"."""

import pathlib
import sys
import tempfile

import numpy as np

import ewa

assert "site-packages" in ewa.__file__, ewa.__file__
splats = ewa.Splats(
    means=[[0, 0, 2]], quats=[[1, 0, 0, 0]], log_scales=[[-1, -1, -1]], opacity_logits=[5], sh=np.ones((1, 1, 3))
)
with tempfile.TemporaryDirectory() as folder:
    for name in ("a.ply", "a.spz", "a.sog", "a.glb"):
        ewa.save(pathlib.Path(folder) / name, splats)
        assert len(ewa.load(pathlib.Path(folder) / name)) == 1
    ewa.save_image(pathlib.Path(folder) / "a.png", np.ones((4, 4, 3)))
    assert ewa.load_image(pathlib.Path(folder) / "a.png").min() == 1

K = np.array([[20, 0, 16.5], [0, 20, 16.5], [0, 0, 1]])
if sys.argv[1:] == ["files"]:
    try:
        ewa.render(splats, np.eye(4), K, 32, 32)
    except ewa.DeviceError as error:
        print(error)
    else:
        sys.exit("there is a device")
else:
    assert ewa.render(splats, np.eye(4), K, 32, 32).alpha[16, 16, 0] > 0.9
    print(ewa.current_device())
