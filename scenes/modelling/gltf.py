# SPDX-License-Identifier: Apache-2.0
"""A glTF 2.0 file: STEM.gltf as text, STEM.bin for the meshes, STEM_*.png for the textures."""

import json
import pathlib

import numpy as np

FLOAT, USHORT, UINT, UBYTE = 5126, 5123, 5125, 5121


class Gltf:
    def __init__(self, sky=None):
        """sky: radiance of zenith, horizon and ground."""
        self.top = {"asset": {"version": "2.0", "generator": "ewa scenes"}, "scene": 0, "scenes": [{"nodes": []}],
                    "nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": []}
        if sky:
            self.top["scenes"][0]["extras"] = {"sky": dict(zip(("zenith", "horizon", "ground"), sky))}
        self.buffer = b""
        self.files = {}

    def _extension(self, name):
        used = self.top.setdefault("extensionsUsed", [])
        if name not in used:
            used.append(name)

    def texture(self, name, png):
        """png: the file's bytes."""
        images = self.top.setdefault("images", [])
        images.append({"uri": name + ".png"})  # the stem comes before it in write
        self.files[name + ".png"] = png
        self.top.setdefault("textures", []).append({"source": len(images) - 1})
        return len(images) - 1

    def material(self, base=(1, 1, 1), metallic=0.0, roughness=1.0, texture=None, metal_texture=None, emitted=None,
                 diffuse=False, two_sided=False, cutoff=None):
        """base: linear RGB. diffuse: no reflection but the Lambert layer's. cutoff: opacity from which it is there."""
        pbr = {"baseColorFactor": [*map(float, base), 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}
        if texture is not None:
            pbr["baseColorTexture"] = {"index": texture}
        if metal_texture is not None:
            pbr["metallicRoughnessTexture"] = {"index": metal_texture}
        entry = {"pbrMetallicRoughness": pbr}
        if diffuse:
            entry["extensions"] = {"KHR_materials_specular": {"specularFactor": 0.0}}
            self._extension("KHR_materials_specular")
        if emitted is not None:
            strength = max(emitted)
            entry["emissiveFactor"] = [float(v) / strength for v in emitted]
            entry.setdefault("extensions", {})["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
            self._extension("KHR_materials_emissive_strength")
        if two_sided:
            entry["doubleSided"] = True
        if cutoff is not None:
            entry.update(alphaMode="MASK", alphaCutoff=cutoff)
        self.top["materials"].append(entry)
        return len(self.top["materials"]) - 1

    def _accessor(self, values, component, kind):
        dtype = {FLOAT: "<f4", USHORT: "<u2", UINT: "<u4"}[component]
        data = np.ascontiguousarray(values, dtype)
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        self.top["bufferViews"].append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": data.nbytes})
        self.buffer += data.tobytes()
        entry = {"bufferView": len(self.top["bufferViews"]) - 1, "componentType": component, "count": len(data),
                 "type": kind}
        if kind == "VEC3" and component == FLOAT:
            entry.update(min=data.min(axis=0).tolist(), max=data.max(axis=0).tolist())
        self.top["accessors"].append(entry)
        return len(self.top["accessors"]) - 1

    def mesh(self, parts):
        """parts: pairs of a shape and a material."""
        primitives = []
        for shape, material in parts:
            entry = self.top["materials"][material]["pbrMetallicRoughness"]
            attributes = {"POSITION": self._accessor(shape.positions, FLOAT, "VEC3"),
                          "NORMAL": self._accessor(shape.normals, FLOAT, "VEC3")}
            if any("Texture" in key for key in entry):
                attributes["TEXCOORD_0"] = self._accessor(shape.uvs, FLOAT, "VEC2")
            small = len(shape.positions) <= 65535
            indices = self._accessor(shape.indices, USHORT if small else UINT, "SCALAR")
            primitives.append({"attributes": attributes, "indices": indices, "material": material})
        self.top["meshes"].append({"primitives": primitives})
        return len(self.top["meshes"]) - 1

    def place(self, mesh=None, offset=(0, 0, 0), rotation=None, scale=1.0, **more):
        """rotation: 3 x 3."""
        node = dict(more)
        if mesh is not None:
            node["mesh"] = mesh
        if rotation is not None:
            node["rotation"] = quaternion(rotation)
        if any(offset):
            node["translation"] = [round(float(v), 6) for v in offset]
        if scale != 1.0:
            node["scale"] = [float(scale)] * 3
        self.top["nodes"].append(node)
        self.top["scenes"][0]["nodes"].append(len(self.top["nodes"]) - 1)

    def sun(self, towards, irradiance):
        """A directional light that shines in the direction `towards`."""
        self._extension("KHR_lights_punctual")
        strength = max(irradiance)
        lights = self.top.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append({"type": "directional", "intensity": strength, "color": [v / strength for v in irradiance]})
        self.place(rotation=looking(np.zeros(3), np.asarray(towards, np.float64)),
                   extensions={"KHR_lights_punctual": {"light": len(lights) - 1}})

    def camera(self, name, position, target, vertical_degrees):
        cameras = self.top.setdefault("cameras", [])
        lens = {"type": "perspective", "perspective": {"yfov": float(np.radians(vertical_degrees)), "znear": 0.01}}
        if lens not in cameras:
            cameras.append(lens)
        self.place(offset=position, rotation=looking(np.asarray(position), np.asarray(target)), name=name,
                   camera=cameras.index(lens))

    def rings_of_cameras(self, target, rings, vertical_degrees):
        """rings: (count, distance, degrees above the target). Names go round all rings in turn, so that every k-th camera
        in name order is spread over them."""
        places = []
        for ring, (count, distance, height) in enumerate(rings):
            for i in range(count):
                turn, up = 2 * np.pi * (i + 0.5 * (ring % 2)) / count, np.radians(height)
                offset = distance * np.array([np.cos(up) * np.sin(turn), np.sin(up), np.cos(up) * np.cos(turn)])
                places.append(((i + 0.5 * (ring % 2)) / count, ring, np.asarray(target) + offset))
        for number, (_, _, position) in enumerate(sorted(places, key=lambda p: p[:2])):
            self.camera(f"view_{number:02}", position, target, vertical_degrees)

    def write(self, path):
        """path: the .gltf."""
        path = pathlib.Path(path)
        for image in self.top.get("images", []):
            name = image["uri"]
            image["uri"] = f"{path.stem}_{name}"
            (path.parent / image["uri"]).write_bytes(self.files[name])
        self.top["buffers"] = [{"uri": path.stem + ".bin", "byteLength": len(self.buffer)}]
        (path.parent / (path.stem + ".bin")).write_bytes(self.buffer)
        path.write_text(json.dumps(self.top, separators=(",", ":")).replace("},{", "},\n{") + "\n")
        sizes = {p.name: p.stat().st_size for p in sorted(path.parent.glob(path.stem + "[._]*")) if p.suffix != ".py"}
        triangles = sum(self.top["accessors"][p["indices"]]["count"] // 3 for n in self.top["nodes"] if "mesh" in n
                        for p in self.top["meshes"][n["mesh"]]["primitives"])
        print(f"{path.name}: {triangles} triangles, {sum(sizes.values()) / 1024:.0f} KiB in {len(sizes)} files")


def looking(position, target):
    """Axes (columns) of what stands at `position` and looks along -z at `target`, y up."""
    back = position - target
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 1.0, 0.0] if abs(back[1]) < 0.999 else [0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=-1)


def quaternion(r):
    """x y z w of a rotation matrix, by the largest component (Shepperd 1978)."""
    r = np.asarray(r, np.float64)
    four = np.array([1 + r[0, 0] - r[1, 1] - r[2, 2], 1 - r[0, 0] + r[1, 1] - r[2, 2],
                     1 - r[0, 0] - r[1, 1] + r[2, 2], 1 + np.trace(r)])
    i = int(np.argmax(four))
    x = np.array([[four[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
                  [r[0, 1] + r[1, 0], four[1], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
                  [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], four[2], r[1, 0] - r[0, 1]],
                  [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], four[3]]])[i]
    return [round(float(v), 8) for v in x / np.linalg.norm(x)]
