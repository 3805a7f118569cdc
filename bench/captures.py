#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes captures from photos alone to held-out figures, and writes one table.

    scripts/bench captures FOLDER [--only NAME,NAME...] [--steps N] [--downscale K] [--seeds S,S...] [--peers FILE]
                           [--out FOLDER] [--ewa PROGRAM] [-- OPTIONS of ewa train]

FOLDER has one folder for each capture: photos, or a folder `photos` with them. `reference_cameras.json` beside them, if it is there, has
{"NAME": [[rotation world to camera, row by row], [centre]]}, and the table says how far the cameras are turned from it. PEERS is JSON:
{"CAPTURE": {"PROGRAM": PSNR}}. The cameras are searched once for each program and capture, and a finished run is not trained again.
"""
import argparse, collections, hashlib, json, math, pathlib, re, signal, statistics, struct, sys, time

sys.dont_write_bytecode = True  # no cache beside a script
import quality
from quality import PROJECT, child, ewa, say, shown, write_file

quality.SCRIPT = "captures"
PICTURES = {".jpg", ".jpeg", ".png", ".heic", ".tif", ".tiff", ".bmp"}
TURNED = 10  # degrees, from which a camera is wrong

Run = collections.namedtuple("Run", "psnr best best_step fitted ssim splats seconds train chosen")


def parse(words):
    at = words.index("--") if "--" in words else len(words)
    parser = quality.Parser(usage=argparse.SUPPRESS, allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
                            description=__doc__)
    parser.add_argument("folder", metavar="FOLDER", type=pathlib.Path)
    parser.add_argument("--only", metavar="NAME,NAME...", type=lambda text: text.split(","), help="of the captures [all]")
    parser.add_argument("--steps", metavar="N", type=quality.count, default=1000, help="[%(default)s]")
    parser.add_argument("--downscale", metavar="K", type=int, default=2, help="[%(default)s]")
    parser.add_argument("--seeds", metavar="S,S...", type=quality.list_of(int, "whole numbers"), default="1,2,3", help="[%(default)s]")
    parser.add_argument("--peers", metavar="FILE", type=pathlib.Path, help="held-out PSNR of other programs")
    parser.add_argument("--out", metavar="FOLDER", type=pathlib.Path, default=PROJECT / "build/captures",
                        help="for datasets, runs, captures.md and captures.json [build/captures]")
    parser.add_argument("--ewa", metavar="PROGRAM", type=pathlib.Path, default=PROJECT / "build/release/ewa",
                        help="the program to measure [build/release/ewa]")
    options = parser.parse_intermixed_args(words[:at])
    options.more = words[at + 1:]
    return options


def read_json(file):
    try:
        return json.loads(file.read_text())
    except OSError as error:
        quality.stop(f"{file}: {error.strerror}")
    except ValueError:
        quality.stop(f"{file}: is not JSON")


def captures_in(options):
    """{name: folder of photos}"""
    if not options.folder.is_dir():
        quality.stop(f"{options.folder}: there is no such folder")
    found = {}
    for capture in sorted(path for path in options.folder.iterdir() if path.is_dir()):
        photos = capture / "photos" if (capture / "photos").is_dir() else capture
        if any(file.suffix.lower() in PICTURES for file in photos.iterdir()):
            found[capture.name] = photos
    if missing := sorted(set(options.only or ()) - set(found)):
        quality.stop(f"{options.folder}: there is no capture {', '.join(missing)}")
    if not found:
        quality.stop(f"{options.folder}: no folder in it has photos")
    return {name: photos for name, photos in found.items() if not options.only or name in options.only}


# ---- cameras ----

def rotations_of(model):
    """{stem of the name: rotation world to camera, row by row} of COLMAP's images.bin."""
    data, at, rotations = (model / "images.bin").read_bytes(), 8, {}
    for _ in range(struct.unpack_from("<Q", data)[0]):
        w, x, y, z = struct.unpack_from("<4d", data, at + 4)
        at += 4 + 7 * 8 + 4
        end = data.index(b"\0", at)
        rotations[pathlib.Path(data[at:end].decode()).stem] = [
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
        at = end + 1
        at += 8 + 24 * struct.unpack_from("<Q", data, at)[0]
    return rotations


def product(a, b, transpose=False):
    """a b, or the transpose of a times b."""
    return [sum((a[3 * k + i] if transpose else a[3 * i + k]) * b[3 * k + j] for k in range(3)) for i in range(3) for j in range(3)]


def angle_between(a, b):
    """Degrees."""
    trace = sum(x * y for x, y in zip(a, b))
    return math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1) / 2))))


def turned_from(reference, rotations):
    """Degrees by which each camera is turned from its reference. The worlds differ by a rotation: the one that most cameras share."""
    names = sorted(set(reference) & set(rotations))
    worlds = [product(rotations[name], reference[name][0], transpose=True) for name in names]
    if not worlds:
        return []
    world = min(worlds, key=lambda one: statistics.median(angle_between(one, other) for other in worlds))
    return sorted(angle_between(world, other) for other in worlds)


def search(photos, folder, options):
    """What ewa cameras finds: {placed, photos, seconds, doubts, turned}."""
    found, work = folder / "search.json", folder / "dataset"
    if found.exists():
        return read_json(found)
    folder.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    with open(folder / "cameras.log", "w") as said:
        status, log = ewa(options.program, "cameras", photos, "-o", work, stdout=said)
    log = (folder / "cameras.log").read_text() + log
    result = {"placed": 0, "photos": sum(file.suffix.lower() in PICTURES for file in photos.iterdir()),
              "seconds": time.monotonic() - begun, "turned": [], "doubts": []}
    lines = [line for line in log.splitlines() if line]
    if counts := re.search(r"(\d+) of (\d+) photos have cameras", log):
        result |= {"placed": int(counts[1]), "photos": int(counts[2])}
    result["doubts"] = [line for line in lines if "may be wrong" in line or "probably wrong" in line]
    result["tries"] = [line for line in lines if re.match(r"placed \d+ of \d+ photos.* in \d+ s", line)]
    if status != 0:
        result["failure"] = lines[-1] if lines else f"status {status}"
    elif (reference := photos.parent / "reference_cameras.json").exists():
        result["turned"] = turned_from(read_json(reference), rotations_of(work / "sparse/0"))
    if status == 0:  # a search that failed is tried again
        write_file(found, json.dumps(result, indent=2) + "\n")
    return result


# ---- runs ----

def train(folder, seed, options):
    """A Run, or one line that tells what went wrong."""
    words = ["--steps", options.steps, "--seed", seed, "--downscale", options.downscale, "--eval-every", max(1, options.steps // 10),
             "--metrics", "fitted_psnr", *options.more]
    key = hashlib.sha256(json.dumps(words).encode()).hexdigest()[:12]
    out = folder / f"{options.steps}-{seed}-{key}"
    if not (out / "done").exists():
        status, complaint = ewa(options.program, "train", folder / "dataset", "-o", out, "--quiet", "--force", *words)
        if status != 0:
            return f"ewa ended with status {status}: {' '.join(complaint.split())}"
        for name in quality.NOT_KEPT:
            (out / name).unlink(missing_ok=True)
        (out / "done").touch()
    summary, config = read_json(out / "summary.json"), read_json(out / "config.json")
    curve = [line for line in map(json.loads, (out / "metrics.jsonl").read_text().splitlines()) if "test_psnr" in line]
    if not curve:
        return "no photo is held out"
    best = max(curve, key=lambda line: line["test_psnr"])
    return Run(summary["test_psnr"], best["test_psnr"], best["step"], curve[-1].get("test_fitted_psnr"), summary["test_ssim"],
               summary["splats"], summary["seconds"], summary["train_psnr"],
               f"{summary['strategy']}, appearance {config.get('appearance', '-')}, background {config.get('background', '-')}")


# ---- table ----

def mean(runs, name):
    values = [getattr(run, name) for run in runs]
    return statistics.fmean(values) if values and None not in values else None


def row_of(name, found, runs, peers):
    turned = found["turned"]
    cells = [name, f"{found['placed']} of {found['photos']}", f"{found['seconds']:.0f}"]
    wrong = sum(degrees > TURNED for degrees in turned)
    cells.append(f"{statistics.median(turned):.1f}, {turned[-1]:.1f}" + (f"; {wrong} wrong" if wrong else "") if turned else "-")
    cells.append(str(len(found["doubts"])))
    deviation = statistics.stdev(run.psnr for run in runs) if len(runs) > 1 else None
    best = max(runs, key=lambda run: run.best) if runs else None
    cells += [shown(mean(runs, "seconds"), ".0f"), shown(mean(runs, "psnr"), ".2f"), shown(deviation, ".2f"),
              f"{best.best:.2f} at {best.best_step:,}" if best else "-", shown(mean(runs, "fitted"), ".2f"),
              shown(mean(runs, "train"), ".2f"), shown(mean(runs, "ssim"), ".3f"), shown(mean(runs, "splats"), ",.0f"),
              runs[0].chosen if runs else found.get("failure", "-")]
    return cells + [", ".join(f"{program} {psnr:.2f}" for program, psnr in peers.get(name, {}).items()) or "-"]


HEADINGS = ("capture", "placed", "search, s", "turned: median, largest", "doubts", "training, s", "PSNR, dB", "+-", "best", "fitted",
            "training views", "SSIM", "splats", "chosen", "peers")


def markdown(options, rows):
    seeds = f"{len(options.seeds)} seeds" if len(options.seeds) > 1 else f"seed {options.seeds[0]}"
    text = (f"{options.steps:,} steps, `--downscale {options.downscale}`, {seeds}"
            f"{''.join(' ' + word for word in options.more)}\n\n")
    text += "| " + " | ".join(HEADINGS) + " |\n|" + "---|" * len(HEADINGS) + "\n"
    return text + "".join("| " + " | ".join(row) + " |\n" for row in rows)


def main(words):
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, child.stop)
    options = parse(words)
    options.program, digest = quality.program_of(options.ewa)
    peers = read_json(options.peers) if options.peers else {}
    rows, results, failed = [], {}, 0
    for name, photos in captures_in(options).items():
        key = hashlib.sha256((digest + quality.content_of(photos)).encode()).hexdigest()[:12]
        folder = options.out / f"{name}-{key}"
        found = search(photos, folder, options)
        say(f"{name}: {found['placed']} of {found['photos']} photos placed in {found['seconds']:.0f} s")
        runs = []
        for seed in options.seeds if found["placed"] > 0 else ():
            result = train(folder, seed, options)
            if isinstance(result, str):
                failed += 1
                say(f"{name}, seed {seed}: failed: {result}")
                continue
            runs.append(result)
            say(f"{name}, seed {seed}: {result.psnr:.2f} dB, {result.splats:,} splats, {result.seconds:.0f} s")
        failed += found["placed"] == 0
        rows.append(row_of(name, found, runs, peers))
        results[name] = {"search": found, "runs": [run._asdict() for run in runs]}
        write_file(options.out / "captures.md", markdown(options, rows))
        write_file(options.out / "captures.json", json.dumps({"schema": "ewa-captures-1", "steps": options.steps,
                                                              "downscale": options.downscale, "options": options.more,
                                                              "captures": results}, indent=2) + "\n")
    say("\n" + markdown(options, rows))
    say(f"Also in {options.out / 'captures.md'} and {options.out / 'captures.json'}")
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        quality.stop("interrupted; the same command continues", 130)
