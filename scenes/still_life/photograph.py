#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Photographs the still life: renders the views, and writes their poses and a sparse point cloud.

    python3 photograph.py                 writes images/, sparse/0/ and transforms.json beside this file
    python3 photograph.py --check         tests what is there: poses, conventions, colours, and how glossy it is

The same options give the same bytes. Needs numpy and Pillow.
"""
import argparse
import json
import os
import sys
import time
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing import Pool
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.dont_write_bytecode = True

import numpy as np
from PIL import Image

from studio.arrangement import still_life
from studio.vectors import column, normalize

SEED = 7
QUALITY = 94          # of the JPEG files
EXPOSURE = 1.12
TARGET = (0.0, 0.0, 0.17)
POINTS = 3000
POINT_NOISE = 0.0015  # standard deviation of the point cloud's coordinates, about 0.15 pixels
TRACK = 5             # observations listed for a point, at most
RAYS = 40000          # rays traced at once
REFLECTIVE = {"ball", "apple", "bowl", "vase", "mug", "plate"}


@dataclass
class Camera:
    """A pinhole camera: x right, y down, z forward; pixel centres at +0.5."""
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    rotation: np.ndarray      # world to camera
    translation: np.ndarray   # (3, 1)

    def centre(self):
        """Where the camera stands."""
        return -self.rotation.T @ self.translation

    def rays(self, x, y):
        """Origins and unit directions of the rays through image positions in pixels."""
        d = np.stack([(x - self.cx) / self.fx, (y - self.cy) / self.fy, np.ones_like(x)])
        d = normalize(self.rotation.T @ d)
        return np.broadcast_to(self.centre(), d.shape), d

    def project(self, p):
        """Image positions and depths of world points."""
        q = self.rotation @ p + self.translation
        depth = np.where(q[2] > 1e-6, q[2], 1e-6)
        return self.fx * q[0] / depth + self.cx, self.fy * q[1] / depth + self.cy, q[2]


# ---------------------------------------------------------------------------------------------------------- cameras

def look_at(eye, target):
    """World-to-camera rotation and translation of a level camera at `eye`; z is up in the world."""
    forward = normalize(column(target) - column(eye))
    right = normalize(np.cross(forward, column((0, 0, 1)), axis=0))
    down = np.cross(forward, right, axis=0)
    turn = np.concatenate([right, down, forward], axis=1).T
    return turn, -turn @ column(eye)


def make_cameras(views, width, height):
    """Two rings about the table, a low one and a high one, each gently waving in height and distance."""
    low = (views + 1) // 2
    cameras = []
    for index in range(views):
        upper = index >= low
        count, place = (views - low, index - low) if upper else (low, index)
        azimuth = 2 * np.pi * (place + (0.5 if upper else 0.0)) / count
        elevation = np.radians((49.0 if upper else 23.0) + 4.0 * np.sin(3 * azimuth + upper))
        distance = (2.92 if upper else 2.80) + 0.12 * np.sin(2 * azimuth + 1.0)
        offset = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
        rotation, translation = look_at(np.array(TARGET) + distance * offset, TARGET)
        scale = width / 256.0
        cameras.append(Camera(width, height, 300.0 * scale, 298.0 * scale, width / 2 + 3.0 * scale,
                              height / 2 - 2.0 * scale, rotation, translation))
    return cameras


# ------------------------------------------------------------------------------------------------------ photographs

def strata(rng, pixels, columns, rows):
    """For every pixel columns * rows uniform pairs, one in each cell of a grid, in random order: (2, pixels, cells)."""
    cells = columns * rows
    order = np.argsort(rng.random((pixels, cells)), axis=1)
    corner = np.stack([order % columns, order // columns])
    return (corner + rng.random((2, pixels, cells))) / np.array([columns, rows]).reshape(2, 1, 1)


def expose(scene, camera, grid, seed):
    """Linear radiance of every pixel, (3, height, width), from grid * grid samples each."""
    rng = np.random.default_rng(seed)
    samples = grid * grid
    picture = np.zeros((3, camera.height * camera.width))
    step = max(1, RAYS // samples)
    for first in range(0, picture.shape[1], step):
        pixel = np.arange(first, min(first + step, picture.shape[1]))
        count = pixel.size
        inside = strata(rng, count, grid, grid)
        x = (pixel % camera.width)[:, None] + inside[0]
        y = (pixel // camera.width)[:, None] + inside[1]
        o, d = camera.rays(x.ravel(), y.ravel())
        # Two shadow rays and two rays to the room a sample, stratified over the pixel.
        light = strata(rng, count, 2 * grid, grid).reshape(2, count * samples, 2).swapaxes(1, 2)
        sky = strata(rng, count, 2 * grid, grid).reshape(2, count * samples, 2).swapaxes(1, 2)
        seen = scene.radiance(o, d, light, sky, rng)
        picture[:, pixel] = develop(seen).reshape(3, count, samples).mean(axis=2)
    return picture.reshape(3, camera.height, camera.width)


def develop(radiance):
    """Exposed radiance with a soft shoulder towards white, linear, 0 to 1."""
    x, knee = radiance * EXPOSURE, 0.7
    return np.where(x < knee, x, 1.0 - (1.0 - knee) * np.exp(-(x - knee) / (1.0 - knee)))


def encode(linear):
    """Linear values as 8-bit sRGB, (height, width, 3)."""
    x = np.clip(linear, 0.0, 1.0)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return np.moveaxis(np.round(255.0 * srgb), 0, -1).astype(np.uint8)


@lru_cache
def studio(shiny=True):
    """The scene, built once in every process."""
    return still_life(shiny)


def photograph(job):
    """Renders one view and writes it."""
    index, camera, grid, shiny, path = job
    picture = encode(expose(studio(shiny), camera, grid, [SEED, index]))
    if path is None:
        return picture
    Image.fromarray(picture).save(path, quality=QUALITY, subsampling=0, optimize=True)
    return index


def load_picture(path):
    """An image file as floats 0 to 255, (height, width, 3)."""
    with Image.open(path) as file:
        return np.asarray(file.convert("RGB"), dtype=np.float64)


def sample_picture(picture, x, y):
    """Bilinear colours (n, 3) at image positions in pixels."""
    height, width, _ = picture.shape
    x, y = np.clip(x - 0.5, 0, width - 1.001), np.clip(y - 0.5, 0, height - 1.001)
    i, j = x.astype(int), y.astype(int)
    u, v = (x - i)[:, None], (y - j)[:, None]
    top = picture[j, i] * (1 - u) + picture[j, i + 1] * u
    low = picture[j + 1, i] * (1 - u) + picture[j + 1, i + 1] * u
    return top * (1 - v) + low * v


# ------------------------------------------------------------------------------------------------------ point cloud

def visible(scene, camera, p, slack=0.012):
    """Which points the camera sees: inside the picture, and nothing in front of them."""
    x, y, depth = camera.project(p)
    seen = (depth > 0) & (x > 1) & (x < camera.width - 1) & (y > 1) & (y < camera.height - 1)
    at = np.flatnonzero(seen)
    away = p[:, at] - camera.centre()
    distance = np.sqrt((away * away).sum(axis=0))
    o = np.broadcast_to(camera.centre(), away.shape)
    first = scene.nearest(o, away / distance)[0]
    seen[at] = first > distance - slack
    return seen


def pick_points(scene, camera, picture, count, rng):
    """Surface points behind pixels of a picture, more where it has detail, none at silhouettes."""
    grey = picture.mean(axis=2)
    down, right = np.gradient(grey)
    weight = (np.hypot(down, right) + 2.0).ravel()
    pixel = rng.choice(weight.size, count, replace=False, p=weight / weight.sum())
    x, y = pixel % camera.width + 0.5, pixel // camera.width + 0.5
    o, d = camera.rays(x, y)
    t, which = scene.nearest(o, d)
    fits = which >= 0
    t = np.where(fits, t, 0.0)
    for dx, dy in ((-1.5, 0), (1.5, 0), (0, -1.5), (0, 1.5)):
        t2, which2 = scene.nearest(*camera.rays(x + dx, y + dy))
        fits &= (which2 == which) & (np.abs(t2 - t) < 0.1 * t)
    return (o + t * d)[:, fits]


def make_points(scene, cameras, pictures):
    """The point cloud: positions (3, n), colours (n, 3), errors in pixels, and tracks of view numbers."""
    rng = np.random.default_rng([SEED, 1 << 20])
    draws = 3 * POINTS // len(cameras) + 1
    exact = np.concatenate([pick_points(scene, c, p, draws, rng) for c, p in zip(cameras, pictures)], axis=1)
    seen = np.stack([visible(scene, camera, exact) for camera in cameras])
    usable = np.flatnonzero(seen.sum(axis=0) >= 3)
    chosen = np.sort(rng.choice(usable, min(POINTS, usable.size), replace=False))
    exact, seen = exact[:, chosen], seen[:, chosen]
    noisy = np.round(exact + POINT_NOISE * rng.standard_normal(exact.shape), 5)

    views, errors = np.full((len(cameras), chosen.size, 3), np.nan), np.full((len(cameras), chosen.size), np.nan)
    for k, (camera, picture) in enumerate(zip(cameras, pictures)):
        x, y, _ = camera.project(exact)
        xn, yn, _ = camera.project(noisy)
        views[k, seen[k]] = sample_picture(picture, x, y)[seen[k]]
        errors[k, seen[k]] = np.hypot(xn - x, yn - y)[seen[k]]
    colours = np.round(np.nanmedian(views, axis=0)).astype(int)
    tracks = []
    for column_ in seen.T:
        at = np.flatnonzero(column_)
        tracks.append(at[np.unique(np.linspace(0, at.size - 1, TRACK).astype(int))])
    errors = np.array([errors[track, k].mean() for k, track in enumerate(tracks)])
    return noisy, colours, errors, tracks


# ------------------------------------------------------------------------------------------------------------ files

def quaternion(turn):
    """A rotation matrix as a unit quaternion w x y z with w >= 0."""
    m = turn
    k = np.array([[m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
                  [0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
                  [0, 0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
                  [0, 0, 0, m[2, 2] - m[0, 0] - m[1, 1]]])
    values, columns = np.linalg.eigh(k + np.triu(k, 1).T)
    q = columns[:, np.argmax(values)]
    return q if q[0] >= 0 else -q


def rotation_matrix(q):
    """A unit quaternion w x y z as a rotation matrix."""
    w, x, y, z = np.asarray(q) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def view_name(index):
    """The file name of a view."""
    return f"view_{index:02d}.jpg"


def write_text(path, lines):
    """Writes lines with newline endings on every system."""
    path.write_bytes(("\n".join(lines) + "\n").encode())


def write_colmap(folder, cameras, points):
    """The model as COLMAP text files, without 2D observations."""
    folder.mkdir(parents=True, exist_ok=True)
    c = cameras[0]
    write_text(folder / "cameras.txt", [
        "# CAMERA_ID MODEL WIDTH HEIGHT FX FY CX CY",
        f"1 PINHOLE {c.width} {c.height} {c.fx:.10g} {c.fy:.10g} {c.cx:.10g} {c.cy:.10g}"])
    lines = ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, world to camera; then an empty line (no 2D observations)"]
    for index, camera in enumerate(cameras):
        numbers = [*quaternion(camera.rotation), *camera.translation[:, 0]]
        lines += [" ".join([str(index + 1), *(f"{v:.12f}" for v in numbers), "1", view_name(index)]), ""]
    write_text(folder / "images.txt", lines)
    lines = ["# POINT3D_ID X Y Z R G B ERROR TRACK as (IMAGE_ID POINT2D_IDX)"]
    observed = [0] * len(cameras)
    for number, (p, colour, error, track) in enumerate(zip(points[0].T, *points[1:]), 1):
        fields = [str(number), *(f"{v:.5f}" for v in p), *(str(v) for v in colour), f"{error:.3f}"]
        for view in track:
            fields += [str(view + 1), str(observed[view])]
            observed[view] += 1
        lines.append(" ".join(fields))
    write_text(folder / "points3D.txt", lines)


def write_transforms(path, cameras):
    """The cameras as transforms.json: OpenGL axes, camera to world."""
    c = cameras[0]
    frames = []
    for index, camera in enumerate(cameras):
        pose = np.eye(4)
        pose[:3, :3] = camera.rotation.T @ np.diag([1.0, -1.0, -1.0])
        pose[:3, 3] = camera.centre()[:, 0]
        rows = [[round(float(v), 12) + 0.0 for v in row] for row in pose]
        frames.append({"file_path": f"images/{view_name(index)}", "transform_matrix": rows})
    document = {"camera_model": "PINHOLE", "w": c.width, "h": c.height, "fl_x": c.fx, "fl_y": c.fy, "cx": c.cx,
                "cy": c.cy, "frames": frames}
    write_text(path, [json.dumps(document, indent=1)])


def read_colmap(folder):
    """Cameras by image name, point positions (3, n), colours (n, 3) and tracks, from COLMAP text files."""
    def rows(name, skip_every_second=False):
        lines = [line for line in (folder / name).read_text().splitlines() if not line.startswith("#")]
        return [line.split() for line in (lines[::2] if skip_every_second else lines)]
    lens = {row[0]: ([int(v) for v in row[2:4]], [float(v) for v in row[4:]]) for row in rows("cameras.txt")}
    cameras = {}
    for row in rows("images.txt", skip_every_second=True):
        size, inner = lens[row[8]]
        numbers = [float(v) for v in row[1:8]]
        cameras[row[9]] = Camera(*size, *inner, rotation_matrix(numbers[:4]), column(numbers[4:]))
    points = rows("points3D.txt")
    positions = np.array([[float(v) for v in row[1:4]] for row in points]).T
    colours = np.array([[float(v) for v in row[4:7]] for row in points])
    return cameras, positions, colours, [row[8:] for row in points]


def read_transforms(path):
    """Cameras by image name from transforms.json."""
    document = json.loads(path.read_text())
    inner = [document[key] for key in ("w", "h", "fl_x", "fl_y", "cx", "cy")]
    cameras = {}
    for frame in document["frames"]:
        pose = np.array(frame["transform_matrix"])
        turn = (pose[:3, :3] @ np.diag([1.0, -1.0, -1.0])).T
        cameras[Path(frame["file_path"]).name] = Camera(*inner, turn, -turn @ pose[:3, 3:])
    return cameras


# ------------------------------------------------------------------------------------------------------------ check

def agreement(scene, cameras, pictures, positions, colours, shift=(0.0, 0.0)):
    """Differences (8-bit steps, mean over channels) between points and pictures: one entry per visible pair."""
    differences, owners = [], []
    for name, camera in cameras.items():
        at = np.flatnonzero(visible(scene, camera, positions))
        x, y, _ = camera.project(positions[:, at])
        seen = sample_picture(pictures[name], x + shift[0], y + shift[1])
        differences.append(np.abs(seen - colours[at]).mean(axis=1))
        owners.append(at)
    return np.concatenate(differences), np.concatenate(owners)


def owners_of(scene, positions):
    """The name of the object every point lies on: the item whose surface is nearest, found by short rays."""
    best, name = np.full(positions.shape[1], np.inf), np.full(positions.shape[1], "", dtype=object)
    for direction in np.concatenate([np.eye(3), -np.eye(3)]):
        d = np.broadcast_to(column(direction), positions.shape)
        t, which = scene.nearest(positions - 0.02 * d, d, np.full(positions.shape[1], 0.04))
        gap = np.abs(t - 0.02)
        closer = gap < best
        best = np.where(closer, gap, best)
        name[closer] = [scene.items[k].name for k in which[closer]]
    return name


def projection_gap(first, second, positions):
    """The largest distance in pixels between two cameras' projections of the points in front of them."""
    x, y, depth = first.project(positions)
    u, v, _ = second.project(positions)
    return np.hypot(x - u, y - v)[depth > 0.1].max()


def psnr(a, b):
    """Peak signal-to-noise ratio of 8-bit pictures, dB."""
    return 10 * np.log10(255.0**2 / np.mean((a - b) ** 2))


def check(folder, grid):
    """Reads the files back and reports whether poses, conventions and colours agree; returns the exit status."""
    scene = studio()
    cameras, positions, colours, tracks = read_colmap(folder / "sparse" / "0")
    opengl = read_transforms(folder / "transforms.json")
    pictures = {name: load_picture(folder / "images" / name) for name in cameras}
    centres = np.concatenate([camera.centre() for camera in cameras.values()], axis=1)
    spread = np.linalg.norm(centres - centres.mean(axis=1, keepdims=True), axis=0)
    print(f"{len(cameras)} views of {pictures[min(pictures)].shape[1]}x{pictures[min(pictures)].shape[0]}, "
          f"{positions.shape[1]} points, tracks of at least {min(map(len, tracks)) // 2}")
    print(f"scene extent (1.1 x farthest camera from their mean): {1.1 * spread.max():.3f}")

    apart = max(projection_gap(camera, opengl[name], positions) for name, camera in cameras.items())
    print(f"COLMAP model against transforms.json: projections differ by at most {apart:.1e} pixels")

    names = owners_of(scene, positions)
    reflective = np.isin(names.astype(str), sorted(REFLECTIVE))
    difference, owner = agreement(scene, cameras, pictures, positions, colours)
    matte, shiny = difference[~reflective[owner]], difference[reflective[owner]]
    for label, values in (("not reflecting", matte), ("reflecting", shiny)):
        print(f"colour, {label}: {values.size} pairs of point and view, difference median {np.median(values):.2f}, "
              f"90% below {np.quantile(values, 0.9):.2f} of 255")
    control = []
    for shift in ((0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)):
        moved, at = agreement(scene, cameras, pictures, positions, colours, shift)
        control.append(moved[~reflective[at]].mean())
        print(f"  control, pictures read {shift} pixels beside: mean {control[-1]:.2f} instead of {matte.mean():.2f}")

    ratios = []
    for index in range(0, len(cameras), max(1, len(cameras) // 4)):
        name = view_name(index)
        dull = photograph((index, cameras[name], grid, False, None)).astype(np.float64)
        ratios.append(psnr(dull, pictures[name]))
        print(f"gloss, {name}: {ratios[-1]:.2f} dB between the picture and one without reflections and highlights")

    good = (apart < 1e-6 and np.median(matte) < 6.0 and min(control) > 1.1 * matte.mean()
            and np.median(shiny) > np.median(matte))
    print("the check passes" if good else "the check FAILS")
    return 0 if good else 1


# ------------------------------------------------------------------------------------------------------------- main

def parse():
    """Command line options."""
    def size(text):
        width, height = text.lower().split("x")
        return int(width), int(height)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=size, default=(256, 192), metavar="WxH", help="picture size (256x192)")
    parser.add_argument("--views", type=int, default=48, help="number of views (48)")
    parser.add_argument("--output", type=Path, default=Path(__file__).resolve().parent, help="folder to write or check")
    parser.add_argument("--grid", type=int, default=5, help="samples a pixel, N x N (5)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2); the result does not depend on it")
    parser.add_argument("--only", type=int, nargs="*", help="render just these views, as a preview without poses")
    parser.add_argument("--check", action="store_true", help="test the files in the output folder")
    return parser.parse_args()


def main():
    """Renders the set, or checks it."""
    options = parse()
    if options.check:
        return check(options.output, options.grid)
    start = time.time()
    cameras = make_cameras(options.views, *options.size)
    images = options.output / "images"
    images.mkdir(parents=True, exist_ok=True)
    wanted = range(options.views) if options.only is None else options.only
    jobs = [(k, cameras[k], options.grid, True, images / view_name(k)) for k in wanted]
    with Pool(options.jobs) as pool:
        for done, index in enumerate(pool.imap_unordered(photograph, jobs), 1):
            print(f"{view_name(index)}  {done}/{len(jobs)}  {time.time() - start:.0f} s", flush=True)
    if options.only is None:
        pictures = [load_picture(images / view_name(k)) for k in range(options.views)]
        write_colmap(options.output / "sparse" / "0", cameras, make_points(studio(), cameras, pictures))
        write_transforms(options.output / "transforms.json", cameras)
    return 0


if __name__ == "__main__":
    sys.exit(main())
