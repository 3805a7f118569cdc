#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Gives damaged files to the program: program.py EWA [--runs N] [--seed S] [--findings DIR].

Each run damages one file of a splat scene, a dataset, a training run, an image or a mesh scene, and starts `ewa` on it. The program
must end with status 0, or with status 2 and a line that begins with its name, within the limits on time and memory. A third of the
changes are of structure: lists that are empty, values of other types, names of other files, numbers at limits. A line break is the only control character that it prints. Renders are tried where a device is. Built with the sanitizers
(scripts/damaged), the program also ends at what these find. A finding is kept with its command.
"""
import argparse, concurrent.futures, gzip, io, json, os, pathlib, random, re, resource, shlex, shutil, struct, subprocess, sys
import tempfile, time, zipfile, zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
SEEDS = ROOT / "tests" / "fuzz" / "seeds"
SECONDS = 120  # on a busy machine, under the sanitizers
WORDS = [0, 0xFFFFFFFF, 0x7FFFFFFF, 0x80000000, 0x10000, 1]
NUMBERS = [b"0", b"-1", b"4294967296", b"99999999", b"1e999", b"nan", b"-0.5", b"18446744073709551616"]
FORMATS = ["ply", "compressed.ply", "splat", "spz", "glb", "gltf", "sog"]


def damaged(dice, data, other):
    """The bytes after one to four changes."""
    data = bytearray(data)
    for _ in range(1 + dice.randrange(4)):
        at = dice.randrange(len(data) + 1)
        length = dice.randrange(min(64, len(data) - at) + 1)
        kind = dice.randrange(9)
        if kind == 0:
            del data[at:]
        elif kind in (1, 2) and at < len(data):
            data[at] = data[at] ^ 1 << dice.randrange(8) if kind == 1 else dice.randrange(256)
        elif kind == 3:
            word = struct.pack("<I", dice.choice(WORDS))[: 1 + dice.randrange(4)]
            data[at : at + len(word)] = word[: len(data) - at]
        elif kind == 4:
            del data[at : at + length]
        elif kind == 5:
            data[at:at] = data[at : at + length]
        elif kind == 6:
            data[(to := dice.randrange(len(data) + 1)) : to] = data[at : at + length]
        elif kind == 7:
            begin = dice.randrange(len(other) + 1)
            data[at : at + length] = other[begin : begin + dice.randrange(200)]
        else:
            begin = next((i for i in range(at, len(data)) if data[i] in b"0123456789."), None)
            if begin is not None:
                end = begin
                while end < len(data) and data[end] in b"0123456789.":
                    end += 1
                data[begin:end] = dice.choice(NUMBERS)
    return bytes(data)


LIMITS = [b"0", b"-0.0", b"1", b"-1", b"256", b"2147483648", b"4294967296", b"9007199254740993", b"18446744073709551616", b"3e19",
          b"3.4e38", b"1e39", b"1e309", b"1e-45", b"-1e-30", b"inf", b"nan"]
VALUES = [b"null", b"true", b'""', b'"a"', b"0", b"-1", b"1.5", b"[]", b"{}", b"[[]]", b"[0]", b"[null]", b'["a"]', b'{"a": 1}', b"()", b"None"]
TOKEN = re.compile(rb"\"(?:[^\"\\\n]|\\.)*\"|'[^'\n]*'|[\[\]{}()<>]|[\w.+-]+")


def spans_of(data):
    """Brackets with what is between them, quoted texts, numbers and words: (begin, end), inner ones first."""
    spans, opened = [], []
    for token in TOKEN.finditer(data):
        if token[0] in b"[{(<":
            opened.append(token.start())
        elif token[0] not in b"]})>":
            spans.append(token.span())
        elif opened:
            spans.append((opened.pop(), token.end()))
    return spans


def restructured(dice, data, other):
    """The text after one to three changes of structure; see structure.h. Other bytes are damaged."""
    if any(byte < 9 or byte > 126 for byte in data[:64]) or not spans_of(data):
        return damaged(dice, data, other)
    for _ in range(1 + dice.randrange(3)):
        spans = spans_of(data)
        if not spans:
            break
        is_name = lambda text, span: text[span[1] :].lstrip()[:1] in (b":", b"=")  # noqa: E731
        names = [span for span in spans if is_name(data, span)]
        lists = [span for span in spans if data[span[0]] in b"[{("]
        begin, end = dice.choice([span for span in spans if span not in names] or spans)
        lender = other if dice.random() < 0.5 and spans_of(other[:65536]) else data
        lent = dice.choice(spans_of(lender[:65536]) or [(0, 0)])
        kind = dice.randrange(7)
        if kind == 0 and lists:
            begin, end = dice.choice(lists)
            new = data[begin : begin + 1] + data[end - 1 : end]
        elif kind == 1:
            new = dice.choice(VALUES)
        elif kind == 2:
            begin, end = dice.choice([span for span in spans if data[span[0]] in b"0123456789.-+"] or [(begin, end)])
            new = dice.choice(LIMITS)
        elif kind == 3 and names:
            begin, end = dice.choice(names)
            new = dice.choice([lender[b:e] for b, e in spans_of(lender[:65536]) if is_name(lender, (b, e))] or [b"a"])
        elif kind == 4:
            new = lender[lent[0] : lent[1]]
        elif kind == 5:
            new = data[begin:end] + (b", " + data[begin:end]) * dice.choice([1, 1, 1, 100])
        else:
            new = b""
        if len(new) < 100_000:
            data = data[:begin] + new + data[end:]
    return data


def with_json(dice, data, other):
    """The JSON of a .glb, restructured, in a container that fits again."""
    length = struct.unpack_from("<I", data, 12)[0]
    text = restructured(dice, data[20 : 20 + length], other)
    text += b" " * (-len(text) % 4)
    out = data[:12] + struct.pack("<I", len(text)) + data[16:20] + text + data[20 + length :]
    return out[:8] + struct.pack("<I", len(out)) + out[12:]


def restructured_inside(dice, data, other):
    """The same in the text of a container."""
    if data[:4] == b"glTF":
        return with_json(dice, data, other)
    return damaged_inside(dice, data, other, restructured) if data[:2] == b"PK" else restructured(dice, data, other)


def damaged_inside(dice, data, other, damaged=damaged):  # noqa: F811
    """The same below a compression or a checksum, which would notice any other damage."""
    if data[:2] == b"\x1f\x8b":
        return gzip.compress(damaged(dice, gzip.decompress(data), other), 1)
    if data[:2] == b"PK":
        entries = [(i.filename, zipfile.ZipFile(io.BytesIO(data)).read(i)) for i in zipfile.ZipFile(io.BytesIO(data)).infolist()]
        chosen, packed = dice.randrange(len(entries)), io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            for i, (name, content) in enumerate(entries):
                archive.writestr(name, damaged(dice, content, other) if i == chosen else content)
        return packed.getvalue()
    if data[:4] == b"\x89PNG":
        data, at, out = damaged(dice, data, other), 8, bytearray(b"\x89PNG\r\n\x1a\n")
        while at + 12 <= len(data):
            length = struct.unpack(">I", data[at : at + 4])[0]
            if length > len(data) - at - 12:
                break
            body = data[at + 4 : at + 8 + length]
            out += struct.pack(">I", length) + body + struct.pack(">I", zlib.crc32(body))
            at += 12 + length
        return bytes(out) + data[at:]
    return damaged(dice, data, other)


def png(width, height):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    rows = b"".join(b"\0" + bytes((x * 5 + y * 7 + c * 40) % 256 for x in range(width) for c in range(3)) for y in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def ply(count):
    names = "x y z f_dc_0 f_dc_1 f_dc_2".split() + [f"f_rest_{i}" for i in range(9)]
    names += "opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
    dice = random.Random(3)
    head = f"ply\nformat binary_little_endian 1.0\ncomment SplatRenderMode: mip\nelement vertex {count}\n"
    head += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    return head.encode() + b"".join(struct.pack(f"<{len(names)}f", *(dice.gauss(0, 1) for _ in names)) for _ in range(count))


def colmap(folder, binary):
    views, points = 3, 12
    sparse = folder / "sparse" / "0"
    sparse.mkdir(parents=True)
    (folder / "images").mkdir()
    for i in range(views):
        (folder / "images" / f"{i}.png").write_bytes(png(24, 18))
    poses = [(1, 0, 0, 0, 0.1 * i, 0, 4) for i in range(views)]
    places = [(0.1 * i - 0.5, 0.05 * i, 0.2 * (i % 3)) for i in range(points)]
    if binary:
        (sparse / "cameras.bin").write_bytes(struct.pack("<QIiQQ4d", 1, 1, 1, 24, 18, 20, 20, 12, 9))
        images = struct.pack("<Q", views)
        for i, pose in enumerate(poses):
            images += struct.pack("<I7dI", i + 1, *pose, 1) + f"{i}.png\0".encode() + struct.pack("<QddQ", 1, 3.0, 4.0, 1)
        (sparse / "images.bin").write_bytes(images)
        all_points = struct.pack("<Q", points)
        for i, place in enumerate(places):
            all_points += struct.pack("<Q3d3BdQII", i + 1, *place, 200, 100, 50, 0.5, 1, 1, 0)
        (sparse / "points3D.bin").write_bytes(all_points)
        return
    (sparse / "cameras.txt").write_text("1 PINHOLE 24 18 20 20 12 9\n")
    (sparse / "images.txt").write_text(
        "".join(f"{i + 1} {' '.join(map(str, pose))} 1 {i}.png\n3.0 4.0 1\n" for i, pose in enumerate(poses)))
    (sparse / "points3D.txt").write_text(
        "".join(f"{i + 1} {x} {y} {z} 200 100 50 0.5 1 0\n" for i, (x, y, z) in enumerate(places)))


def transforms(folder):
    (folder / "images").mkdir(parents=True)
    frames = []
    for i in range(3):
        (folder / "images" / f"{i}.png").write_bytes(png(24, 18))
        matrix = [[1, 0, 0, 0.1 * i], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]
        (folder / f"depth_{i}.png").write_bytes((SEEDS / "read_depth_map" / "ramp.png").read_bytes())
        frames.append({"file_path": f"images/{i}.png", "depth_file_path": f"depth_{i}.png", "transform_matrix": matrix})
    value = {"w": 24, "h": 18, "fl_x": 20, "fl_y": 20, "cx": 12, "cy": 9, "k1": 0.01, "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(value))


def imported(folder):
    """Datasets of other programs: the name of each, and its files that may be damaged."""
    seeds = {"OpenSfM": ("read_open_sfm/three", "reconstruction.json"), "OpenMVG": ("read_open_mvg/three", "sfm_data.json"),
             "Metashape": ("read_metashape/three", "cameras.xml"), "RealityScan": ("read_reality_scan_csv/two", "cameras.csv"),
             "XMP": ("read_reality_scan_xmp/elements", "images/a.xmp"), "Record3D": ("read_record3d/frames", "metadata.json")}
    for name, (seed, file) in seeds.items():
        (folder / name / "images").mkdir(parents=True)
        for image in "abc0123":
            (folder / name / "images" / f"{image}.png").write_bytes(png(48, 36))
        (folder / name / file).write_bytes((SEEDS / seed).read_bytes().split(b"@@@")[0])
    return {name: [file] for name, (_, file) in seeds.items()}


class Case:
    """What is damaged, and the commands that read it. {} is its path, {out} a free name, {good} the undamaged original."""

    def __init__(self, name, path, commands, files=None):
        self.name, self.path, self.commands = name, path, commands
        self.files = files or ["."]  # those that may be damaged, relative to the path


def make_cases(ewa, folder, renders):
    read = ["info {}", "info {} --json --verbose"]
    to_any = [f"convert {{}} {{out}}.{kind} --quiet" for kind in [*FORMATS, "usda", "usdz"]] + ["convert {} {good} -o {out}.ply --sort morton"]
    to_any += ["convert {} {out}.ply --decimate 50% --quiet", "convert {} {out}.ply --decimate 1 --quiet",
               "convert {} {out}/lod-meta.json --levels 2 --quiet", "convert {} {out}/tileset.json --levels 2 --quiet",
               "convert {} {out}.ply --remove-floaters --quiet"]
    if renders:
        to_any.append("render {} -o {out}.png --size 24x16 --quiet")
    cases, base = [], folder / "base.ply"
    base.write_bytes(ply(40))
    splats = [base]
    for name in FORMATS[1:] + ["sog/meta.json", "v4.spz"]:
        splats.append(folder / name if "/" in name else folder / f"base.{name}")
        extra = ["--spz-version", "4"] if name == "v4.spz" else []
        subprocess.run([ewa, "convert", base, splats[-1], "--quiet", *extra], check=True)
    splats += [*sorted(SEEDS.glob("read_ksplat/*")), *sorted(SEEDS.glob("read_sog/*"))]
    for file in splats:
        name = "SOG, unpacked" if file.name == "meta.json" else file.name.split(".", 1)[1].replace("v4.", "")
        if file.name == "meta.json":
            cases.append(Case(name, file.parent, [c.replace("{}", "{}/meta.json") for c in read + to_any],
                              [f.name for f in file.parent.iterdir()]))
        elif file.suffix == ".gltf":
            (pair := folder / "gltf").mkdir()
            for part in (file, file.with_suffix(".bin")):
                shutil.copy(part, pair)
            cases.append(Case(name, pair, [c.replace("{}", "{}/base.gltf") for c in read + to_any], ["base.gltf", "base.bin"]))
        else:
            cases.append(Case(name, file, read + to_any))
    for file in sorted(SEEDS.glob("read_gltf_mesh/*.gl*")):
        cases.append(Case("meshes", file, read))
    for file in [*sorted(SEEDS.glob("read_ply_mesh/*")), *sorted(SEEDS.glob("read_obj_mesh/*"))]:
        cases.append(Case("meshes", file, ["compare {} {good} --json {out}.json"]))
    for file in [*sorted(SEEDS.glob("read_picture/*")), *sorted(SEEDS.glob("read_jpeg/*"))]:
        cases.append(Case("images", file, ["info {}", "compare {} {good} --json {out}.json"]))
    look = ["info {}", "info {} --json", "train {} --check-options --steps 3 -o {out}"]
    for name in ("bin", "txt"):
        colmap(folder / name, name == "bin")
        cases.append(Case("COLMAP " + name, folder / name, look, [str(p.relative_to(folder / name)) for p in
                                                                  (folder / name).rglob("*") if p.is_file()]))
    transforms(folder / "nerf")
    cases.append(Case("transforms.json", folder / "nerf", look + ["train {} --check-options --loss depth=1 -o {out}"],
                      ["transforms.json", "images/1.png", "depth_1.png"]))
    with zipfile.ZipFile(folder / "a.r3d", "w") as archive:
        archive.writestr("metadata", (SEEDS / "read_r3d" / "frames").read_bytes().split(b"@@@")[0])
        for i in range(4):
            archive.writestr(f"rgbd/{i}.png", png(48, 36))
    cases.append(Case(".r3d", folder / "a.r3d", ["info {}", "info {} --json"]))
    for name, files in imported(folder / "imported").items():
        cases.append(Case(name, folder / "imported" / name, look, files))
    run = folder / "run"
    run.mkdir()
    shutil.copy(base, run / "splats.ply")
    (run / "config.json").write_text(json.dumps({"dataset": "nerf", "steps": 3, "max-splats": 90, "background": "0,0,0"}))
    (run / "metrics.jsonl").write_text('{"step": 1, "loss": 0.5, "seconds": 0.1, "splats": 40}\n')
    (run / "summary.json").write_text(json.dumps({"steps": 3, "test_psnr": 20.5}))
    options = f"train {folder}/nerf --config {{}}/config.json --check-options -o {{out}}"
    cases.append(Case("run", run, ["info {}", "info {} --json", "convert {} {out}.spz --quiet", options],
                      ["config.json", "metrics.jsonl", "summary.json", "splats.ply"]))
    return cases


def run_one(ewa, cases, number, seed, folder, sanitized):
    """The kind, the status, the seconds, kilobytes, and what is wrong; the folder stays if something is."""
    dice = random.Random(f"{seed}-{number}")
    kinds = sorted({case.name for case in cases})
    case = dice.choice([case for case in cases if case.name == kinds[number % len(kinds)]])
    other = dice.choice(cases)
    here = folder / str(number)
    here.mkdir()
    path = here / case.path.name
    (shutil.copytree if case.path.is_dir() else shutil.copy)(case.path, path)
    target = path / dice.choice(case.files) if case.path.is_dir() else path
    lender = other.path / other.files[0] if other.path.is_dir() else other.path
    change = dice.choice([damaged, damaged_inside, restructured_inside])
    target.write_bytes(change(dice, target.read_bytes(), lender.read_bytes()))
    # As in shell words: the paths of this script have no blanks.
    words = dice.choice(case.commands).replace("{good}", str(case.path)).replace("{out}", str(here / "out")).replace("{}", str(path))
    command = [ewa, *words.split()]
    started = time.monotonic()
    with open(here / "stdout", "wb") as out, open(here / "stderr", "wb") as err:
        child = subprocess.Popen(command, stdout=out, stderr=err, stdin=subprocess.DEVNULL)
        timer = concurrent.futures.thread.threading.Timer(SECONDS, child.kill)
        timer.start()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        timer.cancel()
    seconds = time.monotonic() - started
    size = sum(f.stat().st_size for f in here.rglob("*") if f.is_file())
    most = 4 * size // 1024 + (1_500_000 if sanitized else 300_000) + (700_000 if words.startswith("render") else 0)
    text = (here / "stderr").read_bytes() + (here / "stdout").read_bytes()
    last = (here / "stderr").read_bytes().splitlines()[-1:]
    wrong = ""
    if child.returncode not in (0, 2):
        wrong = f"status {child.returncode}"
    elif child.returncode == 2 and not (last and last[0].startswith(b"ewa ")):
        wrong = "no line of error"
    elif b"runtime error" in text or b"Sanitizer" in text:
        wrong = "a report of the sanitizers"
    elif any(byte < 32 and byte != 10 for byte in text):
        wrong = "a control character in what it prints"
    elif usage.ru_maxrss > most:
        wrong = f"{usage.ru_maxrss} kB of memory, more than {most}"
    if wrong:
        (here / "command").write_text(shlex.join(map(str, command)) + "\n")
    else:
        shutil.rmtree(here)
    return case.name, child.returncode, seconds, usage.ru_maxrss, wrong, here


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ewa")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--findings", type=pathlib.Path, default=ROOT / "build" / "fuzz" / "findings")
    given = parser.parse_args()
    ewa = str(pathlib.Path(given.ewa).resolve())
    # ewa may be a script, such as one that starts a program for Windows.
    sanitized = b"libasan" in subprocess.run(["ldd", ewa], capture_output=True).stdout
    os.environ.update(LC_ALL="C.UTF-8", UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1", ASAN_OPTIONS="detect_leaks=0")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    totals, findings = {}, []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        renders = subprocess.run([ewa, "devices"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
        cases = make_cases(ewa, folder, renders)
        (runs := folder / "runs").mkdir()
        os.chdir(runs)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            work = lambda number: run_one(ewa, cases, number, given.seed, runs, sanitized)  # noqa: E731
            for kind, status, seconds, kilobytes, wrong, here in pool.map(work, range(given.runs)):
                count, read, slowest, largest = totals.get(kind, (0, 0, 0, 0))
                totals[kind] = count + 1, read + (status == 0), max(slowest, seconds), max(largest, kilobytes)
                if wrong:
                    kept = given.findings / f"program-{given.seed}-{here.name}"
                    shutil.rmtree(kept, ignore_errors=True)
                    shutil.copytree(here, kept)
                    findings.append(f"{kind}: {wrong}; {kept}")
        os.chdir(ROOT)
    print(f"{'kind':<20}{'runs':>6}{'read':>6}{'refused':>9}{'slowest':>10}{'largest':>10}")
    for kind, (count, read, slowest, largest) in totals.items():
        print(f"{kind:<20}{count:>6}{read:>6}{count - read:>9}{slowest:>8.1f} s{largest / 1000:>7.0f} MB")
    print(*findings, f"program: {given.runs} runs, {len(findings)} findings", sep="\n")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
