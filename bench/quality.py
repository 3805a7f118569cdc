#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Trains datasets at several numbers of steps and seeds, and writes held-out quality and training time as tables and a diagram.

    scripts/bench quality [DATASET...] [--steps N,N...] [--seeds S,S...] [--strategies NAME,NAME...] [--before PROGRAM]
                          [--out FOLDER] [--json FILE] [--svg FILE] [--ewa PROGRAM] [-- OPTIONS of ewa train]

DATASET is the name of a scene in scenes/, of a folder in $EWA_SHARED/data or ../shared/data, or a path. --before trains each run
with another ewa program too, just before, and the tables have before, after and difference. A finished run is not trained again
unless its program, dataset or options have changed. A run that fails is reported, and the others follow; the exit status is then 1.
"""
import argparse, collections, contextlib, hashlib, json, os, pathlib, signal, statistics, subprocess, sys, time

sys.dont_write_bytecode = True  # no cache beside a script
import quality_diagram

PROJECT = pathlib.Path(__file__).resolve().parents[1]
SHARED = pathlib.Path(os.environ.get("EWA_SHARED", PROJECT.parent / "shared")) / "data"
SCENES, RENDERED = PROJECT / "scenes", PROJECT / "build/quality/datasets"
DATASETS = ("fox_270", "fox_540", "tea_table", "railing", "plaster")
STRATEGIES = ("default", "adc", "mcmc", "none")
SCRIPT = "quality"  # of scripts/bench; captures.py sets its own
ONLY = "ewa"  # the side of all runs without --before; with it, sides are before and after
WRONG_USE = 2  # exit status of ewa, and of this script
NOT_KEPT = ("checkpoint.ewa", "times.json", "splats.ply")  # a run of a million splats has a gigabyte of them
LPIPS_NETWORK = "vgg"  # as in the papers on splats

Dataset = collections.namedtuple("Dataset", "name path content")
Run = collections.namedtuple("Run", "dataset strategy steps seed side")
Figures = collections.namedtuple("Figures", "psnr ssim splats seconds lpips session summary")


def say(text):
    print(text, flush=True)


def stop(text, status=WRONG_USE):
    print(f"{SCRIPT}: {text}", file=sys.stderr)
    sys.exit(status)


# ---- options and datasets ----

def count(text):
    number = float(text[:-1]) * 1000 if text.lower().endswith("k") else float(text)
    if number < 1 or number != int(number):
        raise ValueError
    return int(number)


def list_of(convert, expected):
    def convert_all(text):
        try:
            return list(dict.fromkeys(convert(word.strip()) for word in text.split(",")))
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}': expected {expected}") from None
    return convert_all


def strategy(text):
    return STRATEGIES[STRATEGIES.index(text)]


class Parser(argparse.ArgumentParser):
    def error(self, message):
        stop(f"{message} (see scripts/bench {SCRIPT} --help)")


def parse(words):
    at = words.index("--") if "--" in words else len(words)
    parser = Parser(usage=argparse.SUPPRESS, allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter,
                    description=__doc__)
    parser.add_argument("datasets", nargs="*", metavar="DATASET", help=f"[{' '.join(DATASETS)}]")
    parser.add_argument("--steps", metavar="N,N...", type=list_of(count, "numbers such as 250,7k"), default="250,500,1000,2000,7000",
                        help="[%(default)s]")
    parser.add_argument("--seeds", metavar="S,S...", type=list_of(int, "whole numbers"), default="1,2,3", help="[%(default)s]")
    parser.add_argument("--strategies", metavar="NAME,NAME...", type=list_of(strategy, f"some of {', '.join(STRATEGIES)}"),
                        default="default", help=", ".join(STRATEGIES) + " [%(default)s]")
    parser.add_argument("--before", metavar="PROGRAM", type=pathlib.Path, help="an ewa program to compare with")
    parser.add_argument("--out", metavar="FOLDER", type=pathlib.Path, default=PROJECT / "build/quality",
                        help="for the runs, quality.md, quality.json and quality.svg [build/quality]")
    parser.add_argument("--json", metavar="FILE", type=pathlib.Path, help="[FOLDER/quality.json]")
    parser.add_argument("--svg", metavar="FILE", type=pathlib.Path, help="[FOLDER/quality.svg]")
    parser.add_argument("--ewa", metavar="PROGRAM", type=pathlib.Path, default=PROJECT / "build/release/ewa",
                        help="the program to measure [build/release/ewa]")
    options = parser.parse_intermixed_args(words[:at])
    options.more = words[at + 1:]
    options.steps.sort()
    options.json, options.svg = options.json or options.out / "quality.json", options.svg or options.out / "quality.svg"
    return options


def digest_of(*files):
    digest = hashlib.sha256()
    for file in files:
        with open(file, "rb") as data:
            while piece := data.read(1 << 20):
                digest.update(piece)
    return digest.hexdigest()


def content_of(path):
    """A digest of all files of a dataset."""
    if path.is_file() and path.suffix != ".json":
        return digest_of(path)
    folder = path if path.is_dir() else path.parent
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    names = "\n".join(str(file.relative_to(folder)) for file in files)
    return hashlib.sha256((names + digest_of(*files)).encode()).hexdigest()


def program_of(path):
    """(path, digest) of an ewa program."""
    try:
        return path.resolve(), digest_of(path)
    except OSError as error:
        stop(f"{path}: {error.strerror}; scripts/build makes build/release/ewa")


def place_of(name):
    """The folder or scene that a name means, or None."""
    scene, folder, path = SCENES / f"{name}.gltf", SHARED / name, pathlib.Path(name).expanduser()
    known = [place for place in (scene, folder) if "/" not in name and name.strip(".") and place.exists()]
    return known[0] if known else path.resolve() if path.exists() else None


class Child:
    """The ewa that runs now. A signal that stops the script ends it too, at any moment of its life."""
    running, process, stopped = False, None, False

    def stop(self, *_):
        self.stopped = True
        if not self.running:
            raise KeyboardInterrupt
        if self.process:
            self.process.terminate()

    def run(self, words, **how):
        self.running, complaint = True, None
        with subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace",
                              **how) as self.process:
            if self.stopped:
                self.process.terminate()
            while complaint is None:
                # Without a limit, a signal just before the wait would be handled only after it.
                with contextlib.suppress(subprocess.TimeoutExpired):
                    complaint = self.process.communicate(timeout=1)[1]
        status = self.process.returncode
        self.running, self.process = False, None
        if self.stopped:
            raise KeyboardInterrupt
        return status, complaint.strip()


child = Child()


def ewa(program, *words, **how):
    """(exit status, standard error). A mistake in the use of ewa ends the script with ewa's own line."""
    try:
        status, complaint = child.run([str(word) for word in (program, *words)], **how)
    except OSError as error:
        stop(f"{program}: {error.strerror}")
    if status == WRONG_USE:
        stop(complaint)
    return status, complaint


def find_dataset(name, options):
    place = place_of(name)
    if place is None:
        scenes = ", ".join(sorted(path.stem for path in SCENES.glob("*.gltf")))
        stop(f"there is no dataset '{name}': expected a scene ({scenes}), the name of a folder in {SHARED}, or a path")
    label = place.name if place.is_dir() else place.stem
    if place.suffix in (".gltf", ".glb"):
        folder, scene = RENDERED / label, place
        made = (folder / "transforms.json").exists()
        if not made:
            say(f"rendering {scene.name} into {folder}, once")
        status, complaint = ewa(options.ewa, "dataset", scene, "-o", folder, *(["--quiet"] if made else []))
        if status != 0:
            stop(complaint or f"{label}: its views could not be rendered", 1)
        place = folder
    status, complaint = ewa(options.ewa, "info", place, stdout=subprocess.DEVNULL)
    if status != 0:
        stop(complaint, 1)
    return Dataset(label, place, content_of(place))


def find_datasets(options):
    names = options.datasets
    if not names:
        names = [name for name in DATASETS if place_of(name)]
        if missing := sorted(set(DATASETS) - set(names)):
            say(f"without {', '.join(missing)}: not in {SHARED}")
    datasets = [find_dataset(name, options) for name in dict.fromkeys(names)]
    labels = [dataset.name for dataset in datasets]
    if len(set(labels)) < len(labels):
        stop(f"two datasets have one name: {', '.join(labels)}")
    return datasets


# ---- runs ----

def folder_of(run, options):
    """The folder of a run. Its name has a digest of all that the result depends on."""
    files = [word.rpartition("=")[2] for word in options.more]
    contents = [digest_of(file) for file in files if os.path.isfile(file)]
    key = json.dumps([options.programs[run.side][1], run.dataset.content, options.more, contents])
    return options.out / "runs" / (f"{run.dataset.name}-{run.strategy}-{run.steps}-{run.seed}-"
                                   f"{hashlib.sha256(key.encode()).hexdigest()[:12]}")


def read_text(file):
    return file.read_text() if file.exists() else None


def figures_of(folder):
    """The figures of a finished run, or None."""
    try:
        summary = json.loads((folder / "summary.json").read_text())
    except (OSError, ValueError):
        return None
    if summary["interrupted"]:
        return None
    lpips = read_text(folder / "lpips")
    return Figures(summary["test_psnr"], summary["test_ssim"], summary["splats"], summary["seconds"], lpips and float(lpips),
                   read_text(folder / "session"), summary)


def duration(seconds):
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def train(run, folder, options):
    """None, or one line that tells what went wrong."""
    strategy = [] if run.strategy == "default" else ["--strategy", run.strategy]
    status, complaint = ewa(options.programs[run.side][0], "train", run.dataset.path, "-o", folder, "--steps", run.steps,
                            "--seed", run.seed, "--quiet", "--force", *strategy, *options.more)
    if status != 0:
        return f"ewa ended with status {status}: {' '.join(complaint.split())}"
    for name in NOT_KEPT:
        (folder / name).unlink(missing_ok=True)
    (folder / "session").write_text(options.session)
    return None


class Progress:
    """What is done, and how long the rest takes: as long a step as the last run of the same dataset and strategy."""

    def __init__(self, runs):
        self.waiting, self.number, self.rates = list(runs), len(runs), {}

    def ended(self, run, figures):
        self.waiting.remove(run)
        if figures:
            self.rates[run.dataset.name, run.strategy] = figures.summary["wall_seconds"] / run.steps

    def left(self):
        if not self.waiting or not self.rates:
            return ""
        usual = statistics.fmean(self.rates.values())
        seconds = sum(run.steps * self.rates.get((run.dataset.name, run.strategy), usual) for run in self.waiting)
        return f"; {duration(seconds)} left"

    def line(self, run, text):
        side = f", {run.side}" if run.side != ONLY else ""
        named = f", {run.strategy}" if run.strategy != "default" else ""
        return (f"[{self.number - len(self.waiting)}/{self.number}] {run.dataset.name}{named}, {run.steps:,} steps, seed {run.seed}"
                f"{side}: {text}{self.left()}")


def result_text(figures):
    if figures.psnr is None:
        stop("no image is held out, so there is nothing to compare")
    return f"{figures.psnr:.2f} dB, SSIM {figures.ssim:.4f}, {figures.splats:,} splats, {figures.seconds:.1f} s"


def train_all(runs, options, results):
    """Fills results. Returns the number of runs that failed."""
    progress, failed = Progress(runs), 0
    for run in runs:
        if figures := figures_of(folder_of(run, options)):
            results[run] = figures
            progress.ended(run, figures)
    if results:
        say(f"{len(results)} of {len(runs)} runs are in {options.out / 'runs'} already")
    write_report(options, results)  # a file that cannot be written is noticed now
    for run in [run for run in runs if run not in results]:
        folder = folder_of(run, options)
        problem = train(run, folder, options)
        figures = None if problem else figures_of(folder)
        progress.ended(run, figures)
        if problem:
            failed += 1
            say(progress.line(run, f"failed: {problem}"))
            continue
        results[run] = figures
        say(progress.line(run, result_text(figures)))
        write_report(options, results)
    return failed


# ---- LPIPS ----

def lpips_meter():
    """A function of two image files; None without the package or its network."""
    try:
        import lpips, numpy, torch
        from PIL import Image
        network = lpips.LPIPS(net=LPIPS_NETWORK, verbose=False)
    except Exception as error:  # the network may come from a server: many things can be wrong
        say(f"without LPIPS: {' '.join(str(error).split())}")
        return None

    def distance(*files):
        """None if the sizes differ, as those of reduced or undistorted images do."""
        images = [numpy.asarray(Image.open(file).convert("RGB")) for file in files]
        if images[0].shape != images[1].shape:
            return None
        a, b = (torch.from_numpy(image.copy()).permute(2, 0, 1)[None] / 127.5 - 1 for image in images)
        with torch.no_grad():
            return float(network(a, b))
    return distance


def measure_lpips(runs, options, results):
    """Adds the mean over the held-out images that a run has saved."""
    meter = lpips_meter() if any(figures.lpips is None for figures in results.values()) else None
    for run, figures in results.items() if meter else ():
        folder, photos = folder_of(run, options), run.dataset.path / "images"
        renders = sorted((folder / "test").rglob("*.png")) if figures.lpips is None else []
        pairs = [(render, photo) for render in renders
                 for photo in photos.glob(f"{render.relative_to(folder / 'test').with_suffix('')}.*")]
        if distances := [value for pair in pairs if (value := meter(*pair)) is not None]:
            (folder / "lpips").write_text(f"{statistics.fmean(distances)}")
            results[run] = figures_of(folder)


# ---- tables ----

def mean_of(figures, name):
    values = [getattr(f, name) for f in figures]
    return statistics.fmean(values) if values and None not in values else None


def summarised(figures):
    means = {name: mean_of(figures, name) for name in ("psnr", "ssim", "lpips", "splats", "seconds")}
    spread = statistics.stdev(f.psnr for f in figures) if len(figures) > 1 else None
    return means | {"psnr_deviation": spread, "seeds": len(figures)}


def row_of(options, results, dataset, strategy, steps):
    """Means over the seeds. Differences are over the seeds that both sides have."""
    by_seed = {side: {seed: results[run] for seed in options.seeds if (run := Run(dataset, strategy, steps, seed, side)) in results}
               for side in options.programs}
    row = {"dataset": dataset.name, "strategy": strategy, "steps": steps}
    for side, figures in by_seed.items():
        row[side] = summarised(list(figures.values()))
    if options.before:
        seeds = by_seed["before"].keys() & by_seed["after"].keys()
        sides = [[by_seed[side][seed] for seed in sorted(seeds)] for side in ("before", "after")]
        for name in ("psnr", "ssim", "lpips"):
            before, after = (mean_of(figures, name) for figures in sides)
            row[f"{name}_difference"] = None if before is None or after is None else after - before
        # Times of different sessions do not compare: the machine may have had other work.
        timed = [(before, after) for before, after in zip(*sides) if before.session == after.session]
        totals = [sum(figures.seconds for figures in side) for side in zip(*timed)]
        row["seconds_ratio"] = totals[1] / totals[0] if timed else None
    return row


def rows_of(options, results):
    rows = [row_of(options, results, dataset, strategy, steps) for strategy in options.strategies for dataset in options.found
            for steps in options.steps]
    return [row for row in rows if any(row.get(side, {}).get("seeds") for side in options.programs)]


def budgets_of(rows):
    """Of each strategy and number of steps: on how many datasets PSNR is higher than before, and the worst difference."""
    budgets = []
    for strategy, steps in dict.fromkeys((row["strategy"], row["steps"]) for row in rows):
        compared = [(row["psnr_difference"], row["dataset"]) for row in rows
                    if (row["strategy"], row["steps"]) == (strategy, steps) and row.get("psnr_difference") is not None]
        if compared:
            worst, dataset = min(compared)
            budgets.append({"strategy": strategy, "steps": steps, "higher": sum(difference > 0 for difference, _ in compared),
                            "datasets": len(compared), "worst": worst, "worst_dataset": dataset})
    return budgets


def shown(value, layout):
    return "-" if value is None else format(value, layout)


def columns_of(options, rows):
    """[(heading, text of a row)]"""
    sides = list(options.programs)
    columns = [("dataset", lambda row: row["dataset"])]
    if options.strategies != ["default"]:
        columns.append(("strategy", lambda row: row["strategy"]))
    columns.append(("steps", lambda row: f"{row['steps']:,}"))

    def add(title, name, layout, difference=None, difference_layout=None):
        for side in sides:
            heading = title if len(sides) == 1 else f"{title} {side}" if side == sides[0] else side
            columns.append((heading, lambda row, side=side: shown(row[side][name], layout)))
        if len(sides) > 1 and difference:
            columns.append((difference.rpartition("_")[2], lambda row: shown(row[difference], difference_layout)))

    add("PSNR, dB", "psnr", ".2f", "psnr_difference", "+.2f")
    if len(options.seeds) > 1:
        add("+-", "psnr_deviation", ".2f")
    add("SSIM", "ssim", ".4f", "ssim_difference", "+.4f")
    if any(row[side]["lpips"] is not None for row in rows for side in sides):
        add("LPIPS", "lpips", ".4f", "lpips_difference", "+.4f")
    add("splats", "splats", ",.0f")
    add("seconds", "seconds", ".1f", "seconds_ratio", ".2f")
    return columns


def markdown(options, rows, devices):
    columns = columns_of(options, rows)
    lines = [f"{len(options.seeds)} seeds" if len(options.seeds) > 1 else f"seed {options.seeds[0]}",
             *(["options " + " ".join(options.more)] if options.more else []), *devices]
    text = ", ".join(lines) + "\n\n| " + " | ".join(heading for heading, _ in columns) + " |\n"
    text += "|" + "".join("---|" if heading in ("dataset", "strategy") else "--:|" for heading, _ in columns) + "\n"
    for row in rows:
        text += "| " + " | ".join(cell(row) for _, cell in columns) + " |\n"
    budgets = budgets_of(rows)
    for budget in budgets:
        named = f"{budget['strategy']}, " if options.strategies != ["default"] else ""
        text += ("\n" if budget is budgets[0] else "") + (
            f"- {named}{budget['steps']:,} steps: PSNR is higher on {budget['higher']} of {budget['datasets']} datasets; "
            f"the worst difference is {shown(budget['worst'], '+.2f')} dB ({budget['worst_dataset']})\n")
    return text


def run_json(run, figures):
    return {"dataset": run.dataset.name, "strategy": run.strategy, "steps": run.steps, "seed": run.seed, "side": run.side,
            "psnr": figures.psnr, "ssim": figures.ssim, "lpips": figures.lpips, "splats": figures.splats, "seconds": figures.seconds}


def write_file(path, text):
    """Makes the file's folder too. A reader never sees half a file."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(path.name + ".part")
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        stop(f"{path}: {error.strerror}", 1)


def write_report(options, results):
    """Writes all files. Returns the table."""
    rows = rows_of(options, results)
    devices = sorted({figures.summary["device"] for figures in results.values()})
    table = markdown(options, rows, devices)
    write_file(options.out / "quality.md", table)
    write_file(options.json, json.dumps({
        "schema": "ewa-quality-1", "devices": devices, "options": options.more,
        "programs": {side: {"path": str(path), "sha256": digest} for side, (path, digest) in options.programs.items()},
        "rows": rows, "budgets": budgets_of(rows), "runs": [run_json(run, figures) for run, figures in results.items()]},
        indent=2) + "\n")
    names = [dataset.name for dataset in options.found]
    write_file(options.svg, quality_diagram.svg(rows, names, options.strategies, list(options.programs)))
    return table


# ---- all ----

def main(words):
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, child.stop)
    options, results = parse(words), {}
    options.session = str(time.time_ns())
    options.programs = {ONLY: program_of(options.ewa)}
    if options.before:
        options.programs = {"before": program_of(options.before), "after": options.programs[ONLY]}
        if options.programs["before"][1] == options.programs["after"][1]:
            stop(f"{options.before} and {options.ewa} are the same program")
    options.found = find_datasets(options)
    # Few steps first, so that each dataset has results early. Both programs of a comparison directly follow one another.
    runs = [Run(dataset, strategy, steps, seed, side) for steps in options.steps for seed in options.seeds
            for dataset in options.found for strategy in options.strategies for side in options.programs]
    failed = train_all(runs, options, results)
    measure_lpips(runs, options, results)
    say("\n" + write_report(options, results))
    say(f"Also in {options.out / 'quality.md'}, {options.json} and {options.svg}")
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        stop("interrupted; the same command continues", 130)
