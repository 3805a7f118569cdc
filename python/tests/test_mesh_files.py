# SPDX-License-Identifier: Apache-2.0
"""Other programs read the meshes of `ewa mesh`: trimesh, Khronos' glTF validator, Blender."""

import json
import os
import shutil
import subprocess

import numpy as np
import pytest

import ewa

FORMATS = ["ply", "obj", "glb"]


@pytest.fixture(scope="module")
def meshes(program, tmp_path_factory):
    """A ball of flat splats whose colour changes from left to right, as a mesh in each format."""
    folder = tmp_path_factory.mktemp("meshes")
    n = 600
    z = 1 - (2 * np.arange(n) + 1) / n
    turn = 2.39996 * np.arange(n)
    normals = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    sh = np.zeros((n, 1, 3))
    sh[:, 0, 0] = np.sign(normals[:, 0])
    splats = ewa.Splats(
        means=normals + [0, 0, 3],
        quats=np.stack([1 + z, -normals[:, 1], normals[:, 0], 0 * z], axis=1),  # from z to the normal
        log_scales=np.log(np.tile([0.06, 0.06, 0.002], (n, 1))),
        opacity_logits=np.full(n, 5.0),
        sh=sh,
    )
    ewa.save(folder / "ball.ply", splats)
    for kind in FORMATS:
        program("mesh", folder / "ball.ply", "-o", folder / f"mesh.{kind}", "--voxel", "0.06", "--quiet")
    return folder


def compared(program, meshes, kind):
    """What ewa itself reads."""
    program("compare", meshes / f"mesh.{kind}", meshes / "mesh.glb", "--json", meshes / "figures.json")
    return json.loads((meshes / "figures.json").read_text())


def colors_of(geometry, kind):
    """sRGB in 0..1, as trimesh has the colours."""
    if kind != "glb":
        return geometry.visual.vertex_colors[:, :3] / 255
    linear = geometry.visual.vertex_attributes["color"][:, :3] / 65535
    return np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("kind", FORMATS)
def test_trimesh_reads_shape_and_colours(program, meshes, kind):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.load_scene(meshes / f"mesh.{kind}", process=False)
    mesh = scene.to_mesh()
    ours = compared(program, meshes, kind)
    assert len(mesh.faces) == ours["a"]["triangles"] > 1000
    assert ours["a"] == ours["b"] and ours["chamfer"] < 1e-6
    assert mesh.is_watertight == ours["a"]["watertight"]
    assert mesh.is_winding_consistent
    assert np.allclose(mesh.vertices.mean(axis=0), [0, 0, 3], atol=0.02)
    out = mesh.vertices - [0, 0, 3]
    assert np.all(np.sum(out * mesh.vertex_normals, axis=1) > 0.8)
    (geometry,) = scene.geometry.values()
    colors = colors_of(geometry, kind)
    # At the edge of a picture, half of a pixel shows what is behind.
    sides = np.abs(out[:, 0]) > 0.2
    assert np.allclose(colors[sides, 0], 0.5 + 0.2 * np.sign(out[sides, 0]), atol=0.15)
    (ply,) = trimesh.load_scene(meshes / "mesh.ply", process=False).geometry.values()
    assert np.allclose(colors, colors_of(ply, "ply"), atol=0.002)


def test_the_validator_of_gltf_has_no_complaint(meshes):
    """npm install gltf-validator, and NODE_PATH names its folder."""
    if not shutil.which("node"):
        pytest.skip("node is not installed")
    code = """
        let validator;
        try { validator = require("gltf-validator"); } catch { console.log("missing"); process.exit(); }
        validator.validateBytes(new Uint8Array(require("fs").readFileSync(process.argv[1])))
            .then(report => console.log(JSON.stringify(report.issues)));"""
    words = ["node", "-e", code, meshes / "mesh.glb"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    if done.stdout.strip() == "missing":
        pytest.skip("gltf-validator, from npm, is not installed")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["messages"] == []


def test_blender_imports_all_formats(program, meshes):
    if not shutil.which("blender"):
        pytest.skip("Blender is not installed")
    code = f"""
import numpy
numpy.bool = bool  # Debian 12 has a newer NumPy than its Blender expects
import bpy
for kind, read in (("ply", bpy.ops.import_mesh.ply), ("obj", bpy.ops.wm.obj_import), ("glb", bpy.ops.import_scene.gltf)):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    read(filepath="{meshes}/mesh." + kind)
    (thing,) = bpy.data.objects
    colors = thing.data.color_attributes[0].data
    print("read", kind, len(thing.data.polygons), len(colors) > 0, thing.data.validate(verbose=True))
"""
    (meshes / "read.py").write_text(code)
    words = ["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python", meshes / "read.py"]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    triangles = compared(program, meshes, "glb")["a"]["triangles"]
    lines = [line for line in done.stdout.splitlines() if line.startswith("read ")]
    assert lines == [f"read {kind} {triangles} True False" for kind in ("ply", "obj", "glb")]
