# SPDX-License-Identifier: Apache-2.0
"""Pages, levels, tiles and meshes of scenes."""

import json

import numpy as np
import pytest

import ewa
from conftest import STILL_LIFE, make_splats


@pytest.fixture(scope="module")
def run(program, tmp_path_factory):
    """The folder of a run, whose splats are the points of the still life."""
    folder = tmp_path_factory.mktemp("runs") / "a"
    options = ("--downscale", 4, "--steps", 1, "--strategy", "none", "--background", "white")
    program("train", STILL_LIFE, "-o", folder, *options)
    return folder


def test_a_page_is_that_of_the_command_line(program, tmp_path):
    splats = make_splats(300)
    ewa.save(tmp_path / "scene.ply", splats)
    program("convert", tmp_path / "scene.ply", tmp_path / "theirs/page.html", "--title", "A <b>")
    lines = ewa.save(tmp_path / "ours/page.html", splats, title="A <b>")
    page = (tmp_path / "ours/page.html").read_bytes()
    assert page == (tmp_path / "theirs/page.html").read_bytes()
    assert lines and not any("--" in line for line in lines)
    assert len(splats) == 300 and np.isfinite(splats.means).all()


def test_a_page_has_views(run, program, tmp_path):
    program("convert", run, tmp_path / "theirs.html", "--title", "x")
    for cameras in (run, ewa.Dataset(run)):
        ewa.save(tmp_path / "ours.html", ewa.load(run), title="x", cameras=cameras)
        page = (tmp_path / "ours.html").read_text()
        assert page.count("view_07") == (tmp_path / "theirs.html").read_text().count("view_07") > 0


def test_an_unbundled_page_has_levels_beside_it(tmp_path):
    ewa.save(tmp_path / "page.html", make_splats(3000), unbundled=True, levels=2)
    meta = json.loads((tmp_path / "page-levels/lod-meta.json").read_text())
    assert meta["lodLevels"] == 2
    assert len(ewa.load(tmp_path / "page-levels/lod-meta.json")) == 3000


def test_tiles_and_levels_are_those_of_the_command_line(program, tmp_path):
    splats = make_splats(3000)
    ewa.save(tmp_path / "scene.ply", splats)
    for name, options, words in (
        ("tileset.json", dict(geo=(47, 8, 400)), ["--geo=47,8,400"]),
        ("tileset.json", dict(geo="ecef"), ["--geo=ecef"]),
        ("lod-meta.json", dict(levels=2), ["--levels=2"]),
        ("scene.glb", dict(gltf_spz=True), ["--gltf-spz"]),
    ):
        theirs, ours = tmp_path / "theirs" / name, tmp_path / "ours" / name
        program("convert", tmp_path / "scene.ply", theirs, *words)
        ewa.save(ours, splats, **options)
        assert ours.read_bytes() == theirs.read_bytes(), (name, options)


@pytest.mark.parametrize(
    "name, options, text",
    [
        ("a.ply", dict(title="x"), "^title: only a page has one"),
        ("a.ply", dict(unbundled=True), "^unbundled: only a page"),
        ("a.ply", dict(levels=2), "^levels: only a lod-meta.json"),
        ("a.html", dict(levels=33), "^levels is not from 1 to 32"),
        ("a.ply", dict(geo="ecef"), "^geo: only a tileset.json"),
        ("tileset.json", dict(geo=(100, 0, 0)), "^geo: '100.0,0.0,0.0' is neither ecef nor"),
        ("a.ply", dict(gltf_spz=True), "^gltf_spz: only a .glb or .gltf"),
        ("a.ply", dict(cameras=STILL_LIFE), "^cameras: only a page has views"),
        ("a.obj", dict(), "ewa.mesh makes meshes"),
        ("a.xyz", dict(), r"\.html \(a page\)"),
    ],
)
def test_options_that_an_output_lacks(tmp_path, name, options, text):
    with pytest.raises(ewa.InputError, match=text) as found:
        ewa.save(tmp_path / name, make_splats(), **options)
    assert "--" not in str(found.value) and "\n" not in str(found.value)
    assert not (tmp_path / name).exists()


def wall():
    """A dense square of flat splats at z = 0."""
    n = 40
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    return ewa.Splats(
        means=np.stack([x, y, 0 * x], -1).reshape(-1, 3),
        quats=np.tile([1, 0, 0, 0], (n * n, 1)),
        log_scales=np.tile(np.log([0.04, 0.04, 0.002]), (n * n, 1)),
        opacity_logits=np.full(n * n, 6.0),
        sh=np.tile([[[1.0, 0, 0]]], (n * n, 1, 1)),
    )


@pytest.fixture(scope="module")
def mesh():
    try:
        return ewa.mesh(wall(), voxel=0.04)
    except ewa.DeviceError as error:
        pytest.skip(str(error))


def test_a_mesh_lies_on_the_surface(mesh):
    n, m = len(mesh.positions), len(mesh.triangles)
    assert n > 500 and m > 1000 and repr(mesh) == f"Mesh({n} vertices, {m} triangles)"
    assert mesh.voxel == 0.04 and np.quantile(np.abs(mesh.positions[:, 2]), 0.9) < 3 * 0.04
    assert mesh.triangles.max() == n - 1
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-3)
    assert mesh.colors.shape == (n, 3) and mesh.colors[:, 0].mean() > mesh.colors[:, 1].mean() + 50


def test_a_mesh_is_saved(mesh, tmp_path):
    mesh.save(tmp_path / "new/wall.ply")
    assert f"element vertex {len(mesh.positions)}".encode() in (
        tmp_path / "new/wall.ply"
    ).read_bytes()
    for name in ("wall.glb", "wall.obj"):
        mesh.save(tmp_path / f"new/{name}", up="z")
        assert (tmp_path / f"new/{name}").stat().st_size > 10000
    with pytest.raises(ewa.InputError, match="a mesh is a .ply, .obj or .glb"):
        mesh.save(tmp_path / "wall.stl")
    with pytest.raises(ewa.InputError, match="up: "):
        mesh.save(tmp_path / "wall.glb", up="w")


def test_a_mesh_is_placed(mesh):
    turned = ewa.mesh(wall(), voxel=0.04, transform="move=0,0,5")
    assert np.allclose(turned.positions, mesh.positions + [0, 0, 5], atol=1e-5)
    matrix = np.diag([2, 2, 2, 1.0])
    large = ewa.mesh(wall(), voxel=0.04, transform=matrix)
    assert np.allclose(large.positions, 2 * mesh.positions, atol=1e-5) and large.voxel == 0.08
    assert ewa.mesh(wall(), voxel=0.04, collision=True).colors.shape == (0, 3)


def test_a_mesh_of_a_run_is_that_of_the_command_line(mesh, run, program, tmp_path):
    program("mesh", run, "-o", tmp_path / "theirs.ply", "--voxel", 0.2)
    for given, cameras in ((run, None), (run / "splats.ply", None), (ewa.load(run), run)):
        made = ewa.mesh(given, tmp_path / "ours.ply", cameras=cameras, voxel=0.2)
        assert (tmp_path / "ours.ply").read_bytes() == (tmp_path / "theirs.ply").read_bytes()
    assert len(made.triangles) > 0


def test_wrong_meshes(mesh, tmp_path):
    for options, text in (
        (dict(voxel=0), "voxel is not from"),
        (dict(triangles=2), "triangles is less than 4"),
        (dict(depth="man"), "depth: .*did you mean mean"),
        (dict(output=tmp_path / "a.stl"), "a mesh is a .ply"),
        (dict(transform="spin=1"), "^transform: 'spin=1' is not"),
        (dict(voxel=1e9), "take a smaller voxel=|no surface"),
    ):
        with pytest.raises(ewa.InputError, match=text) as found:
            ewa.mesh(wall(), **options)
        assert "--" not in str(found.value)
