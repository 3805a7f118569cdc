# SPDX-License-Identifier: Apache-2.0
"""Splats in memory and on disk, and images on disk."""

import copy
import pickle
import re
import warnings

import numpy as np
import pytest
from conftest import SEEDS, make_splats

import ewa

ARRAYS = ["means", "quats", "log_scales", "opacity_logits", "sh"]


def same(a, b):
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in [*ARRAYS, "origin"])


@pytest.mark.parametrize("degree", range(4))
def test_arrays_have_shapes_and_values(degree):
    splats = make_splats(7, degree)
    assert len(splats) == 7 and splats.sh_degree == degree
    assert (
        splats.means.shape == (7, 3)
        and splats.quats.shape == (7, 4)
        and splats.log_scales.shape == (7, 3)
    )
    assert splats.opacity_logits.shape == (7,) and splats.sh.shape == (7, (degree + 1) ** 2, 3)
    assert all(getattr(splats, name).dtype == np.float32 for name in ARRAYS)
    random = np.random.default_rng(0)
    assert np.array_equal(splats.means, random.uniform(-1, 1, (7, 3)).astype(np.float32))


@pytest.mark.parametrize("name", ARRAYS + ["origin"])
def test_arrays_are_views_that_keep_their_memory(name):
    splats = make_splats(3)
    array = getattr(splats, name)
    assert np.shares_memory(array, getattr(splats, name))
    array[...] = 0.25
    assert np.all(getattr(splats, name) == 0.25)
    setattr(splats, name, np.ones_like(array))
    assert np.all(array == 1)
    del splats
    array += 1
    assert np.all(array == 2)


def test_augmented_assignment_works():
    splats = make_splats(3)
    before = splats.means.copy()
    splats.means += 1
    assert np.array_equal(splats.means, before + 1)


def test_an_assigned_view_of_the_same_splats_is_read_first():
    splats = make_splats(4)
    expected = splats.means[::-1].copy()
    splats.means = splats.means[::-1]
    assert np.array_equal(splats.means, expected)


def test_no_argument_is_copied_where_it_need_not_be():
    # Constructors copy: what the caller does with its array later does not matter.
    means = np.zeros((2, 3), np.float32)
    splats = ewa.Splats(
        means=means,
        quats=np.ones((2, 4)),
        log_scales=means,
        opacity_logits=[0, 0],
        sh=np.zeros((2, 1, 3)),
    )
    means[:] = 5
    assert np.all(splats.means == 0)


@pytest.mark.parametrize(
    "changed, message",
    [
        ({"means": np.zeros((4, 2))}, "means has the shape (4, 2); expected (n, 3)"),
        ({"quats": np.zeros((4, 4))}, "quats has the shape (4, 4); expected (5, 4)"),
        ({"log_scales": np.zeros(5)}, "log_scales has the shape (5,); expected (5, 3)"),
        ({"opacity_logits": 1.0}, "opacity_logits has the shape (); expected (5,)"),
        (
            {"sh": np.zeros((5, 5, 3))},
            "sh has the shape (5, 5, 3); expected (5, 1, 3) or (5, 4, 3) or (5, 9, 3) or (5, 16, 3)",
        ),
        ({"origin": [0, 0]}, "origin has the shape (2,); expected (3,)"),
        ({"origin": [0, 0, np.nan]}, "origin is not finite"),
        ({"means": [[1, 2, 3], [4]]}, "means is no array: its parts differ in length"),
    ],
)
def test_wrong_shapes_name_argument_and_shape(changed, message):
    arrays = {"means": np.zeros((5, 3)), "quats": np.zeros((5, 4)), "log_scales": np.zeros((5, 3))}
    arrays |= {"opacity_logits": np.zeros(5), "sh": np.zeros((5, 1, 3))}
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        ewa.Splats(**{**arrays, **changed})


def test_wrong_types_are_refused():
    splats = make_splats(2)
    with pytest.raises(TypeError, match="means holds no real numbers: its dtype is <U1"):
        splats.means = [["a", "b", "c"], ["d", "e", "f"]]
    with pytest.raises(TypeError, match="complex128"):
        splats.means = np.zeros((2, 3), complex)
    with pytest.raises(ValueError, match=r"means has the shape \(3, 3\); expected \(2, 3\)"):
        splats.means = np.zeros((3, 3))


def test_strided_and_other_types_are_converted():
    wide = np.arange(24, dtype=np.int64).reshape(4, 6)
    splats = make_splats(4)
    splats.means = wide[:, ::2]
    assert np.array_equal(splats.means, wide[:, ::2])


@pytest.mark.parametrize(
    "key", [slice(1, 4), slice(None, None, -2), [3, 0, 3], np.arange(6) % 2 == 0, 2, -1, []]
)
def test_indexing_is_numpys_and_copies(key):
    splats = make_splats(6)
    if isinstance(key, list):
        key = np.array(key, int)
    some = splats[key]
    assert np.array_equal(some.means, np.reshape(splats.means[key], (-1, 3)))
    assert np.array_equal(some.sh, np.reshape(splats.sh[key], (-1, 16, 3)))
    assert not np.shares_memory(some.means, splats.means)


@pytest.mark.parametrize(
    "key", [6, -7, [0, 9], np.ones(5, bool), np.zeros((6, 2), int), "means", 1.5]
)
def test_wrong_keys_are_refused(key):
    with pytest.raises((IndexError, ValueError)):
        make_splats(6)[key]


def test_join_takes_the_largest_degree():
    a, b = make_splats(2, 0), make_splats(3, 2, seed=1)
    both = ewa.join(a, b)
    assert len(both) == 5 and both.sh_degree == 2
    assert np.array_equal(both.means, np.concatenate([a.means, b.means]))
    assert np.array_equal(both.sh[:2, 0], a.sh[:, 0]) and np.all(both.sh[:2, 1:] == 0)
    assert np.array_equal(both.sh[2:], b.sh)
    with pytest.raises(TypeError):
        ewa.join()
    with pytest.raises(TypeError):
        ewa.join(a, a.means)


def test_from_points():
    splats = ewa.Splats.from_points([[0, 0, 0], [1, 0, 0]], [[255, 0, 0], [0, 0, 255]], sh_degree=1)
    assert splats.sh.shape == (2, 4, 3)
    c0 = 0.28209479177387814
    assert np.allclose(splats.sh[:, 0] * c0 + 0.5, [[1, 0, 0], [0, 0, 1]], atol=1e-6)
    assert np.allclose(splats.log_scales, 0, atol=1e-6)
    with pytest.raises(ValueError, match=r"colors has the shape \(1, 3\); expected \(2, 3\)"):
        ewa.Splats.from_points([[0, 0, 0], [1, 0, 0]], [[255, 0, 0]])
    with pytest.raises(ewa.InputError):
        ewa.Splats.from_points(np.zeros((0, 3)), np.zeros((0, 3)))


def test_ply_holds_every_bit(tmp_path):
    splats = make_splats(20)
    assert ewa.save(tmp_path / "a.ply", splats, comments=["one", "two"]) == []
    again = ewa.load(tmp_path / "a.ply")
    assert same(splats, again) and again.comments == ["one", "two"] and not again.antialiased
    ewa.save(str(tmp_path / "b.ply"), again, antialiased=True)
    assert ewa.load(str(tmp_path / "b.ply")).antialiased
    assert ewa.load(tmp_path / "b.ply")[:3].antialiased
    ewa.save(tmp_path / "c.ply", ewa.load(tmp_path / "b.ply"))
    assert ewa.load(tmp_path / "c.ply").antialiased
    ewa.save(tmp_path / "d.ply", ewa.load(tmp_path / "b.ply"), antialiased=False)
    assert not ewa.load(tmp_path / "d.ply").antialiased


@pytest.mark.parametrize("name", ["a.spz", "a.splat", "a.sog", "a.glb", "a.compressed.ply"])
def test_other_formats_say_what_they_do_not_hold(tmp_path, name):
    splats = make_splats(20)
    lines = ewa.save(tmp_path / name, splats)
    assert isinstance(lines, list) and (lines or name == "a.glb")
    again = ewa.load(tmp_path / name)
    assert len(again) == 20
    order = np.argsort(splats.means[:, 0]), np.argsort(again.means[:, 0])
    assert np.allclose(splats.means[order[0]], again.means[order[1]], atol=2e-3)


def test_files_are_those_of_the_command_line(tmp_path, program):
    splats = make_splats(20)
    ewa.save(tmp_path / "a.ply", splats)
    program("convert", tmp_path / "a.ply", tmp_path / "b.spz")
    ewa.save(tmp_path / "c.spz", ewa.load(tmp_path / "a.ply"))
    assert (tmp_path / "b.spz").read_bytes() == (tmp_path / "c.spz").read_bytes()


def test_empty_scenes(tmp_path):
    empty = make_splats(3)[:0]
    assert len(empty) == 0 and empty.means.shape == (0, 3)
    ewa.save(tmp_path / "empty.ply", empty)
    assert len(ewa.load(tmp_path / "empty.ply")) == 0


def test_files_that_cannot_be_read(tmp_path):
    path = tmp_path / "cut.ply"
    path.write_bytes((SEEDS / "read_ply/little.ply").read_bytes()[:-5])
    with pytest.raises(ewa.InputError, match=re.escape(str(path))) as caught:
        ewa.load(path)
    assert isinstance(caught.value, ValueError) and "\n" not in str(caught.value)
    with pytest.raises(ewa.InputError, match="No such file"):
        ewa.load(tmp_path / "none.ply")
    with pytest.raises(TypeError):
        ewa.load(3)


def test_damaged_files_are_input_errors_or_load(tmp_path):
    tried = 0
    for path in sorted(SEEDS.glob("read_*/*")):
        if path.suffix not in (".ply", ".spz", ".splat", ".ksplat", ".sog", ".glb"):
            continue
        data = path.read_bytes()
        for damaged in (data[:60], data.replace(b"\0\0", b"\xff\xfe", 3)):
            (tmp_path / path.name).write_bytes(damaged)
            tried += 1
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    ewa.load(tmp_path / path.name)
            except ewa.InputError as error:
                assert "\n" not in str(error)
    assert tried > 10


def test_files_that_cannot_be_written(tmp_path):
    splats = make_splats(2)
    with pytest.raises(ewa.InputError, match="not a supported kind"):
        ewa.save(tmp_path / "a.txt", splats)
    (tmp_path / "nowhere").write_text("a file")
    with pytest.raises(OSError, match="nowhere"):
        ewa.save(tmp_path / "nowhere/a.ply", splats)
    with pytest.raises(ValueError, match="spz_version"):
        ewa.save(tmp_path / "a.spz", splats, spz_version=5)
    with pytest.raises(TypeError):
        ewa.save(tmp_path / "a.ply", splats.means)


def test_skipped_contents_are_warnings(tmp_path):
    path = tmp_path / "more.ply"
    ewa.save(path, make_splats(1))
    header, values = path.read_bytes().split(b"end_header\n", 1)
    path.write_bytes(header + b"property float confidence\nend_header\n" + values + b"\0\0\0\0")
    with pytest.warns(
        UserWarning, match="more.ply: properties that splats do not have are skipped: confidence"
    ):
        ewa.load(path)


def test_images(tmp_path):
    path = tmp_path / "a.png"
    image = np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)
    ewa.save_image(path, image)
    read = ewa.load_image(path)
    assert read.dtype == np.float32 and np.array_equal(np.round(read * 255), image)
    ewa.save_image(path, np.dstack([image / 255, np.full((5, 7), 0.5)]))
    assert ewa.load_image(path).shape == (5, 7, 4)
    with pytest.raises(
        ValueError, match=r"image has the shape \(5, 7\); expected \(H, W, 3\) or \(H, W, 4\)"
    ):
        ewa.save_image(path, image[..., 0])
    with pytest.raises(ewa.InputError):
        ewa.load_image(SEEDS / "read_ply/little.ply")


def test_splats_are_pickled_and_copied():
    splats = make_splats(7, 2)
    splats.antialiased = True
    splats.origin = (1e6, 2, 3)
    for other in (pickle.loads(pickle.dumps(splats)), copy.copy(splats), copy.deepcopy(splats)):
        assert same(other, splats) and other.antialiased and other.comments == splats.comments
        assert not any(np.shares_memory(getattr(other, n), getattr(splats, n)) for n in ARRAYS)
    with pytest.raises(ValueError, match="another version"):
        ewa.Splats.__new__(ewa.Splats).__setstate__((1, 2))
