# SPDX-License-Identifier: Apache-2.0
"""Uses an installed wheel of the Python package: try_wheel.py [files|plain|DATASET]

"files" renders and trains nothing: there is no driver. "plain" is a wheel of the system's libraries, which has no modules inside.
The folder DATASET is trained on for 200 steps. The splats go to splats.ply.
"""

import json
import pathlib
import sys
import tempfile

import numpy as np

import ewa

assert "site-packages" in ewa.__file__, ewa.__file__
MODE = "".join(sys.argv[1:])
SIZE = 48
K = np.array([[50, 0, SIZE / 2], [0, 50, SIZE / 2], [0, 0, 1]])


def try_files(folder):
    splats = ewa.Splats(
        means=[[0, 0, 2]], quats=[[1, 0, 0, 0]], log_scales=[[-1, -1, -1]], opacity_logits=[5], sh=np.ones((1, 1, 3))
    )
    for name in ("a.ply", "a.spz", "a.sog", "a.glb"):
        ewa.save(folder / name, splats)
        assert len(ewa.load(folder / name)) == 1
    ewa.save_image(folder / "a.png", np.ones((4, 4, 3)))
    assert ewa.load_image(folder / "a.png").min() == 1
    if MODE != "plain":
        try_other_images(folder)
    return splats


def try_other_images(folder):
    (folder / "a.tif").write_bytes(
        b"MM\0*\0\0\0\x08\0\x08"
        + b"".join(
            tag.to_bytes(2, "big") + b"\0\3\0\0\0\1" + value.to_bytes(2, "big") + b"\0\0"
            for tag, value in ((256, 1), (257, 1), (258, 8), (259, 1), (262, 1), (273, 110), (278, 1), (279, 1))
        )
        + b"\0\0\0\0\xff"
    )
    assert ewa.load_image(folder / "a.tif").min() == 1


def camera(angle):
    """Looks at the origin from a circle around it: the view matrix."""
    forward = -np.array([np.sin(angle), 0, np.cos(angle)])
    rotation = np.array([np.cross([0, 1, 0], forward), [0, 1, 0], forward])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = rotation, [0, 0, 3]
    return view


def try_training(folder):
    """Renders a few balls, and finds them again from these images."""
    balls = np.array([[0, 0, 0], [0.5, 0.2, 0.2], [-0.5, -0.3, 0.3], [0.1, 0.5, -0.4]])
    colors = np.array([[1, 0.1, 0.1], [0.1, 1, 0.1], [0.1, 0.1, 1], [1, 1, 0.1]])
    truth = ewa.Splats(
        means=balls,
        quats=[[1, 0, 0, 0]] * 4,
        log_scales=np.full((4, 3), np.log(0.15)),
        opacity_logits=[4] * 4,
        sh=((colors - 0.5) / 0.28209479)[:, None, :],
    )
    views = np.array([camera(angle) for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False)])
    frames = []
    for i, color in enumerate(ewa.render(truth, views, np.array([K] * len(views)), SIZE, SIZE).color):
        ewa.save_image(folder / f"{i}.png", color)
        pose = np.linalg.inv(views[i]) @ np.diag([1, -1, -1, 1])
        frames.append({"file_path": f"{i}.png", "transform_matrix": pose.tolist()})
    intrinsics = {"fl_x": 50, "fl_y": 50, "cx": SIZE / 2, "cy": SIZE / 2, "w": SIZE, "h": SIZE}
    (folder / "transforms.json").write_text(json.dumps({**intrinsics, "frames": frames}))
    data = ewa.Dataset(folder)
    before = ewa.Splats.from_points(balls + 0.05, np.full((4, 3), 128, np.uint8))
    trainer = ewa.Trainer(data, steps=300, init=before, max_splats=100, seed=1)
    for _ in trainer:
        pass
    psnr = [ewa.evaluate(splats, data).psnr for splats in (before, trainer.splats())]
    print(f"PSNR before training {psnr[0]:.1f}, after it {psnr[1]:.1f}")
    assert psnr[1] > psnr[0] + 5 and psnr[1] > 25, psnr
    if MODE != "plain":
        mesh = ewa.mesh(truth, cameras=data, voxel=0.015)
        print(f"a mesh of {len(mesh.triangles)} triangles")
        assert len(mesh.triangles) > 100


if pathlib.Path(MODE).is_dir() and MODE:
    trainer = ewa.Trainer(MODE, steps=200, seed=1)
    for _ in trainer:
        pass
    ewa.save("splats.ply", trainer.splats())
    sys.exit()
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    splats = try_files(folder)
    if MODE == "files":
        try:
            ewa.render(splats, np.eye(4), K, SIZE, SIZE)
        except ewa.DeviceError as error:
            print(error)
        else:
            sys.exit("there is a device")
    else:
        assert ewa.render(splats, np.eye(4), K, SIZE, SIZE).alpha[SIZE // 2, SIZE // 2, 0] > 0.9
        print(ewa.current_device())
        (folder / "photos").mkdir()
        try_training(folder / "photos")
