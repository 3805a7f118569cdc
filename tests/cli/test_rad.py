#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Spark's .rad, read and written by a program that shares nothing with ewa but the text of the format: test_rad.py EWA."""
import json, math, pathlib, random, shutil, struct, subprocess, sys, tempfile, unittest, zlib

SH_C0 = 0.28209479177387814
COUNT = 400
NAMES = "x y z f_dc_0 f_dc_1 f_dc_2".split() + [f"f_rest_{i}" for i in range(45)]
NAMES += "opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()


def f32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def sigmoid(x):
    return 1 / (1 + math.exp(-x))


def splats(count, seed=5):
    """center, alpha, rgb, scales, orientation (x y z w) and sh of each, as .rad has them."""
    dice, made = random.Random(seed), []
    for _ in range(count):
        turn = [dice.gauss(0, 1) for _ in range(4)]
        length = math.copysign(math.hypot(*turn), turn[3])
        made.append({"center": [f32(dice.uniform(-3, 3)) for _ in range(3)],
                     "alpha": [dice.uniform(0.02, 0.98)],
                     "rgb": [dice.uniform(0, 1) for _ in range(3)],
                     "scales": [math.exp(dice.uniform(-7, -2)) for _ in range(3)],
                     "orientation": [v / length for v in turn],
                     "sh": [dice.uniform(-0.5, 0.5) for _ in range(45)]})
    return made


def write_ply(path, rows):
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    lines += [f"property float {name}" for name in NAMES] + ["end_header", ""]
    body = b""
    for row in rows:
        values = [*row["center"], *((v - 0.5) / SH_C0 for v in row["rgb"])]
        values += [row["sh"][3 * k + c] for c in range(3) for k in range(15)]  # the file has channel after channel
        values += [math.log(row["alpha"][0] / (1 - row["alpha"][0])), *map(math.log, row["scales"])]
        x, y, z, w = row["orientation"]
        body += struct.pack(f"<{len(NAMES)}f", *values, w, x, y, z)
    path.write_bytes("\n".join(lines).encode() + body)


def read_ply(path):
    head, body = path.read_bytes().split(b"end_header\n", 1)
    names = [line.split()[2].decode() for line in head.split(b"\n") if line.startswith(b"property float")]
    rows = []
    for values in struct.iter_unpack(f"<{len(names)}f", body):
        value = dict(zip(names, values))
        turn = [value[f"rot_{k}"] for k in (1, 2, 3, 0)]
        length = math.copysign(math.hypot(*turn), turn[3])
        rest = sum(name.startswith("f_rest") for name in names) // 3
        rows.append({"center": [value[name] for name in "xyz"], "alpha": [sigmoid(value["opacity"])],
                     "rgb": [0.5 + SH_C0 * value[f"f_dc_{c}"] for c in range(3)],
                     "scales": [math.exp(value[f"scale_{k}"]) for k in range(3)],
                     "orientation": [v / length for v in turn],
                     "sh": [value[f"f_rest_{c * rest + k}"] for k in range(rest) for c in range(3)]})
    return rows


def turn_of(code):
    x, y = code[0] / 255 * 2 - 1, code[1] / 255 * 2 - 1
    z = 1 - abs(x) - abs(y)
    if z < 0:
        x, y = (1 - abs(y)) * math.copysign(1, x), (1 - abs(x)) * math.copysign(1, y)
    length, half = math.hypot(x, y, z), code[2] / 255 * math.pi / 2
    return [v / length * math.sin(half) for v in (x, y, z)] + [math.cos(half)]


def code_of(turn):
    x, y, z, w = turn
    total = abs(x) + abs(y) + abs(z) or 1
    u, v = x / total, y / total
    if z < 0:
        u, v = (1 - abs(v)) * math.copysign(1, u), (1 - abs(u)) * math.copysign(1, v)
    return [round((u + 1) / 2 * 255), round((v + 1) / 2 * 255), round(math.acos(min(w, 1)) / (math.pi / 2) * 255)]


def decoded(encoding, data, count, numbers, low, high):
    """A list of `numbers` for each splat."""
    total, codes = count * numbers, None
    if encoding == "oct88r8":
        return [turn_of(data[3 * i : 3 * i + 3]) for i in range(count)]
    if encoding.endswith("_lebytes"):
        size = len(data) // total
        data = bytes(data[b * total + i] for i in range(total) for b in range(size))
    if encoding.endswith("_delta"):
        before, codes = 0, []
        for at in range(total):
            before = (0 if at % count == 0 else before) + data[at] & 255
            codes.append(before)
    kind = encoding.removesuffix("_lebytes").removesuffix("_delta")
    if kind in ("f32", "f16", "u16", "u32", "ln_f16"):
        letter = {"f32": "f", "f16": "e", "ln_f16": "e", "u16": "H", "u32": "I"}[kind]
        flat = [v for (v,) in struct.iter_unpack("<" + letter, data)]
        if kind == "ln_f16":
            flat = [math.exp(v) for v in flat]
    else:
        codes = codes or list(data)
        value = {"r8": lambda c: low + c / 255 * (high - low), "s8": lambda c: (c - 256 * (c > 127)) / 127 * high,
                 "ln_0r8": lambda c: math.exp(low + (c - 1) / 254 * (high - low)) if c else 0.0}[kind]
        flat = [value(c) for c in codes]
    assert len(flat) == total
    return [[flat[k * count + i] for k in range(numbers)] for i in range(count)]


def encoded(encoding, values, low, high):
    count, numbers = len(values), len(values[0])
    if encoding == "oct88r8":
        return bytes(c for turn in values for c in code_of(turn))
    flat = [values[i][k] for k in range(numbers) for i in range(count)]
    kind = encoding.removesuffix("_lebytes").removesuffix("_delta")
    if kind in ("f32", "f16", "u16", "u32", "ln_f16"):
        letter = {"f32": "f", "f16": "e", "ln_f16": "e", "u16": "H", "u32": "I"}[kind]
        if kind == "ln_f16":
            flat = [math.log(v) for v in flat]
        data = struct.pack(f"<{len(flat)}{letter}", *flat)
        if encoding.endswith("_lebytes"):
            size = len(data) // len(flat)
            data = bytes(data[i * size + b] for b in range(size) for i in range(len(flat)))
        return data
    code = {"r8": lambda v: round((v - low) / (high - low) * 255), "s8": lambda v: round(v / high * 127) & 255,
            "ln_0r8": lambda v: 1 + round((math.log(v) - low) / (high - low) * 254)}[kind]
    codes = [code(v) for v in flat]
    if encoding.endswith("_delta"):
        codes = [codes[at] - (codes[at - 1] if at % count else 0) & 255 for at in range(len(codes))]
    return bytes(codes)


NUMBERS = {"center": 3, "alpha": 1, "rgb": 3, "scales": 3, "orientation": 4, "sh1": 9, "sh2": 15, "sh3": 21, "child_count": 1,
           "child_start": 1}


def padded(data):
    return data + bytes(-len(data) % 8)


def read_head(data, magic):
    assert data[:4] == magic
    length = struct.unpack_from("<I", data, 4)[0]
    return json.loads(data[8 : 8 + length]), 8 + length + -length % 8


def read_rad(path):
    """The header, and the values of each property, splat by splat."""
    data = path.read_bytes()
    head, begin = read_head(data, b"RAD0")
    assert head["version"] == 1 and head["type"] == "gsplat" and begin % 8 == 0
    values, end = {name: [] for name in NUMBERS}, begin
    for index, place in enumerate(head["chunks"]):
        assert begin + place["offset"] == end
        end += place["bytes"]
        chunk = data[begin + place["offset"] : end]
        meta, at = read_head(chunk, b"RADC")
        assert meta["base"] == index * head["chunkSize"] and at % 8 == 0
        assert struct.unpack_from("<Q", chunk, at)[0] == meta["payloadBytes"] == len(chunk) - at - 8
        expected = 0
        for part in meta["properties"]:
            assert part["offset"] == expected
            expected += part["bytes"] + -part["bytes"] % 8
            packed = chunk[at + 8 + part["offset"] :][: part["bytes"]]
            numbers = NUMBERS[part["property"]]
            values[part["property"]] += decoded(part["encoding"], zlib.decompress(packed, -15), meta["count"], numbers,
                                                part.get("min"), part.get("max"))
    assert end == len(data) and head["allChunkBytes"] == end - begin
    return head, values


def write_rad(path, rows, encodings, chunk_size=65536, gz=True, files=False, codes=0, extra=None, tree=None):
    """encodings: (encoding, min, max) of each property."""
    chunks, places = [], []
    for base in range(0, len(rows), chunk_size):
        part, properties, payload = rows[base : base + chunk_size], [], b""
        columns = {name: [row[name] for row in part] for name in ("center", "alpha", "rgb", "scales", "orientation")}
        bounds = {"sh1": (0, 9), "sh2": (9, 24), "sh3": (24, 45)}
        for name, (first, last) in bounds.items():
            if codes and base == 0:
                columns[name + "_code"] = [row["sh"][first:last] for row in rows[:codes]]
            if not codes:
                columns[name] = [row["sh"][first:last] for row in part]
        if codes:
            columns["sh_label"] = [[(base + i) % codes] for i in range(len(part))]
        if tree:
            columns["child_count"] = [[count] for count, _ in tree[base : base + chunk_size]]
            columns["child_start"] = [[start] for _, start in tree[base : base + chunk_size]]
        for name, column in columns.items():
            kind = name.removesuffix("_code")
            encoding, low, high = encodings.get(kind, ("u32", None, None))
            if name == "orientation" and encoding != "oct88r8":
                column = [value[:3] for value in column]
            data = encoded(encoding, column, low, high)
            if gz:
                packer = zlib.compressobj(6, zlib.DEFLATED, -15)
                data = packer.compress(data) + packer.flush()
            properties.append({"offset": len(payload), "bytes": len(data), "property": name, "encoding": encoding,
                               **({"compression": "gz"} if gz else {}), **({"min": low, "max": high} if high is not None else {})})
            payload += padded(data)
        meta = json.dumps({"version": 1, "base": base, "count": len(part), "payloadBytes": len(payload),
                           "properties": properties}).encode()
        chunks.append(b"RADC" + struct.pack("<I", len(meta)) + padded(meta) + struct.pack("<Q", len(payload)) + payload)
        places.append({"offset": 0 if files else sum(map(len, chunks[:-1])), "bytes": len(chunks[-1]),
                       **({"filename": f"{path.stem}-{len(places)}.radc"} if files else {})})
    meta = json.dumps({"version": 1, "type": "gsplat", "count": len(rows), "maxSh": 3, "chunkSize": chunk_size,
                       "allChunkBytes": sum(map(len, chunks)), "chunks": places, **({"shCodeCount": codes} if codes else {}),
                       **({"lodTree": True} if tree else {}), **(extra or {})}, indent=2).encode()
    head = b"RAD0" + struct.pack("<I", len(meta)) + padded(meta)
    if not files:
        path.write_bytes(head + b"".join(chunks))
        return
    path.write_bytes(head)
    for place, chunk in zip(places, chunks):
        (path.parent / place["filename"]).write_bytes(chunk)


PLAIN = {"center": ("f32", None, None), "alpha": ("f32", None, None), "rgb": ("f32", None, None), "scales": ("f32", None, None),
         "orientation": ("f32", None, None), "sh1": ("f32", None, None), "sh2": ("f32", None, None), "sh3": ("f32", None, None)}
STEPS = {"r8": 1 / 510, "r8_delta": 1 / 510, "s8": 1 / 254, "s8_delta": 1 / 254}
TURNED = 0.0145  # of a quaternion's number: half a step of the map at its widest, and of the angle


def run(*arguments, status=0):
    done = subprocess.run([EWA, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout + done.stderr


class RadTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.rows = splats(COUNT)

    def assert_near(self, got, expected, step, what):
        self.assertEqual(len(got), len(expected), what)
        for a, b in zip(got, expected):
            self.assertLessEqual(abs(a - b), step, what)

    def compare(self, got, expected, steps):
        """steps: half of a step of each property; scales in logarithms."""
        for name, step in steps.items():
            a, b = got[name], expected[name]
            if name == "scales":
                a, b = map(math.log, a), map(math.log, b)
                a, b = list(a), list(b)
            if name == "orientation" and sum(x * y for x, y in zip(a, b)) < 0:
                a = [-v for v in a]
            self.assert_near(a, b, step, name)

    def test_another_reader_finds_the_values(self):
        write_ply(self.folder / "a.ply", self.rows)
        run("convert", self.folder / "a.ply", self.folder / "a.rad")
        head, values = read_rad(self.folder / "a.rad")
        self.assertEqual((head["count"], head["maxSh"], head.get("lodTree")), (COUNT, 3, None))
        by_center = {tuple(row["center"]): row for row in self.rows}
        for i, center in enumerate(values["center"]):
            got = {name: values[name][i] for name in ("center", "alpha", "rgb", "scales", "orientation")}
            got["sh"] = values["sh1"][i] + values["sh2"][i] + values["sh3"][i]
            self.compare(got, by_center.pop(tuple(center)), {"center": 0, "alpha": 1.001 / 510, "rgb": 1.001 / 510,
                         "scales": 5.001 / 508, "orientation": TURNED, "sh": 0.5001 / 254})
        self.assertEqual(by_center, {})

    def test_another_reader_finds_a_tree(self):
        rows = splats(2000, 6)
        write_ply(self.folder / "a.ply", rows)
        text = run("convert", self.folder / "a.ply", self.folder / "a.rad", "--levels", 4)
        self.assertIn("a tree of levels with 2000, 1000, 500, 250, 1 splats", text)
        head, values = read_rad(self.folder / "a.rad")
        self.assertTrue(head["lodTree"] and head["splatEncoding"]["lodOpacity"])
        parents, leaves = {}, []
        for i, ((count,), (start,)) in enumerate(zip(values["child_count"], values["child_start"])):
            if count == 0:
                leaves.append(i)
            self.assertNotEqual(count, 1)
            for child in range(start, start + count):
                self.assertGreater(child, i)
                self.assertNotIn(child, parents)
                parents[child] = i
        self.assertEqual(sorted(parents), list(range(1, head["count"])))
        self.assertEqual(sorted(tuple(values["center"][i]) for i in leaves), sorted(tuple(row["center"]) for row in rows))
        self.assertEqual(values["child_count"][0], [250])
        # A parent is where its children are, and as large as they are together.
        for parent in set(parents.values()):
            children = [i for i, its in parents.items() if its == parent]
            for k in range(3):
                places = [values["center"][i][k] for i in children]
                self.assertTrue(min(places) <= values["center"][parent][k] <= max(places))
            self.assertGreater(max(values["scales"][parent]) * 1.1, min(max(values["scales"][i]) for i in children))

    def test_every_encoding_is_read(self):
        encodings = {
            "center": ["f32", "f16", "f32_lebytes", "f16_lebytes", "r8", "s8"],
            "alpha": ["f32", "f16", "r8"], "rgb": ["f32", "f16", "r8", "r8_delta"],
            "scales": ["f32", "ln_f16", "ln_0r8"], "orientation": ["f32", "f16", "oct88r8"],
            "sh1": ["f32", "f16", "r8", "r8_delta", "s8", "s8_delta"], "sh3": ["f16", "s8_delta"]}
        ranges = {"center": (-3, 3), "alpha": (0, 1), "rgb": (0, 1), "scales": (-8, 0), "sh1": (-0.5, 0.5), "sh3": (-0.5, 0.5)}
        for name, kinds in encodings.items():
            for kind in kinds:
                low, high = ranges.get(name, (0, 1))
                write_rad(self.folder / "a.rad", self.rows, {**PLAIN, name: (kind, low, high)}, gz=kind != "f16")
                run("convert", self.folder / "a.rad", self.folder / "b.ply")
                step = STEPS.get(kind, 0) * (high - low) * 1.001 or 2e-3 * ("f16" in kind)
                for got, row in zip(read_ply(self.folder / "b.ply"), self.rows):
                    steps = dict.fromkeys(("center", "alpha", "rgb", "scales", "orientation", "sh"), 2e-6)
                    steps["sh" if name.startswith("sh") else name] += step
                    if kind == "ln_0r8":
                        steps["scales"] = 0.5001 * 8 / 254
                    if kind == "ln_f16":
                        steps["scales"] = 4e-3
                    if kind == "oct88r8":
                        steps["orientation"] = TURNED
                    if name == "orientation":
                        steps["orientation"] += 0.04 * (kind == "f16")  # of w near 0
                    self.compare(got, row, steps)

    def test_chunks_files_and_codes_are_read(self):
        for number, options in enumerate(({"chunk_size": 100}, {"chunk_size": 150, "files": True}, {"chunk_size": 150, "gz": False})):
            write_rad(self.folder / f"{number}.rad", self.rows, PLAIN, **options)
            run("convert", self.folder / f"{number}.rad", self.folder / "b.ply")
            for got, row in zip(read_ply(self.folder / "b.ply"), self.rows):
                self.compare(got, row, {"center": 0, "rgb": 1e-6, "sh": 1e-6})
        write_rad(self.folder / "codes.rad", self.rows, PLAIN, chunk_size=150, codes=40)
        run("convert", self.folder / "codes.rad", self.folder / "b.ply")
        for i, got in enumerate(read_ply(self.folder / "b.ply")):
            self.compare(got, {**self.rows[i], "sh": self.rows[i % 40]["sh"]}, {"center": 0, "sh": 1e-6})
        (self.folder / "1-2.radc").unlink()
        self.assertIn("1-2.radc", run("info", self.folder / "1.rad", status=2))

    def test_chunk_files_belong_to_their_input(self):
        write_rad(self.folder / "s.rad", self.rows, PLAIN, chunk_size=150, files=True)
        chunk = self.folder / "s-0.radc"
        before = chunk.read_bytes()
        self.assertIn("values of an input", run("convert", self.folder / "s.rad", self.folder / "b.ply", "--json", chunk, status=2))
        self.assertEqual(chunk.read_bytes(), before)
        size = sum(file.stat().st_size for file in self.folder.glob("s*.rad*"))
        self.assertIn(f", {size / 1000:.3g} kB\n", run("convert", self.folder / "s.rad", self.folder / "b.ply"))

    def test_hard_links_to_one_file_count_once(self):
        write_rad(self.folder / "s.rad", self.rows, PLAIN, chunk_size=150, files=True)
        head = (self.folder / "s.rad").read_bytes()
        meta = json.loads(head[8 : 8 + struct.unpack("<I", head[4:8])[0]])
        together = b""
        for place in meta["chunks"]:
            file = self.folder / place["filename"]
            place["offset"] = len(together)
            together += file.read_bytes()
            file.unlink()
        (self.folder / "all.radc").write_bytes(together)
        for place in meta["chunks"]:
            (self.folder / place["filename"]).hardlink_to(self.folder / "all.radc")
        text = json.dumps(meta).encode()
        (self.folder / "s.rad").write_bytes(b"RAD0" + struct.pack("<I", len(text)) + padded(text))
        size = (self.folder / "s.rad").stat().st_size + len(together)
        self.assertIn(f", {size / 1000:.3g} kB\n", run("convert", self.folder / "s.rad", self.folder / "b.ply"))

    def test_the_leaves_of_a_tree_are_the_scene(self):
        rows = self.rows[:6]
        tree = [(2, 1), (0, 0), (3, 3), (0, 0), (0, 0), (0, 0)]
        write_rad(self.folder / "a.rad", rows, {**PLAIN, "child_count": ("u16", None, None)}, tree=tree, extra={"comment": "one\ntwo"})
        text = run("info", self.folder / "a.rad")
        self.assertIn("tree of 6 splats", text)
        run("convert", self.folder / "a.rad", self.folder / "b.ply")
        self.assertEqual([row["center"] for row in read_ply(self.folder / "b.ply")], [rows[i]["center"] for i in (1, 3, 4, 5)])
        self.assertIn(b"comment one\ncomment two\n", (self.folder / "b.ply").read_bytes())
        for wrong in ([(2, 1), (0, 0), (3, 2), (0, 0), (0, 0), (0, 0)], [(2, 1), (2, 3), (2, 4), (0, 0), (0, 0), (0, 0)],
                      [(2, 1), (0, 0), (3, 4), (0, 0), (0, 0), (0, 0)], [(1, 1), (0, 0), (3, 3), (0, 0), (0, 0), (0, 0)]):
            write_rad(self.folder / "a.rad", rows, {**PLAIN, "child_count": ("u16", None, None)}, tree=wrong)
            self.assertIn('of the "lodTree"', run("info", self.folder / "a.rad", status=2))


if __name__ == "__main__":
    EWA = sys.argv.pop(1)
    unittest.main()
