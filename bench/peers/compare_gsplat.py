#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Trains the same images with gsplat and with ewa, and prints time, quality and memory side by side.

    bench/peers/compare_gsplat.py DATASET [--steps N] [--compare steps,seconds,splats] [--strategy adc|mcmc|none] [--only ewa|gsplat]

DATASET is a COLMAP folder with pinhole cameras, as text or binary, for example fox_270. Both train on the same images with the same
first points, SH degrees and held-out images. Comparisons:
  steps     the same number of steps
  seconds   gsplat has the seconds that ewa needed for its steps
  splats    both continue from the splats of ewa's run, with full SH degree and without a strategy, so that their number is equal

gsplat has the defaults of its simple_trainer.py: rates, thresholds, SSIM within the image, Adam(fused=True). ewa has those of
docs/training_options.md. The lines below the table list what is not equal. Seconds are those of the steps alone, without loading
and evaluation.

gsplat needs a CUDA device, and the packages gsplat, torch, numpy and pillow. SSIM is that of fused_ssim, or of fussim, or else by
convolutions. Without a package or a device the script prints one line, and its exit status is 2.

It ran with gsplat 1.5.3, PyTorch 2.11 and CUDA 13.0 on an NVIDIA H200, before it had fussim, a fused Adam, and --compare.
"""
import argparse, array, collections, gc, json, math, pathlib, random, struct, subprocess, sys, tempfile, time

EWA = pathlib.Path(__file__).resolve().parent.parent.parent / "build/release/ewa"
TEST_EVERY = 8  # as in ewa: of the images in name order, the first of each 8 is held out
SH_DEGREE, SH_C0 = 3, 0.28209479177387814
SH_DEGREE_EVERY = 1000  # steps
SSIM_WEIGHT = 0.2
MEAN_RATE, MEAN_DECAY = 1.6e-4, 0.01
RATES = {"scales": 5e-3, "quats": 1e-3, "opacities": 5e-2, "sh0": 2.5e-3, "shN": 2.5e-3 / 20}
CAMERA_PARAMETERS = {"SIMPLE_PINHOLE": 3, "PINHOLE": 4}
MODEL_NAMES = ["SIMPLE_PINHOLE", "PINHOLE"]  # by COLMAP's number

View = collections.namedtuple("View", "name rotation translation width height focal centre")
Figures = collections.namedtuple("Figures", "comparison trainer device steps splats seconds step_ms psnr device_mib")
Run = collections.namedtuple("Run", "comparison steps strategy first", defaults=[None])  # first: a file of splats, or the points
COMPARISONS = ("steps", "seconds", "splats")
SPLATS_STEPS = 1000  # at most, of the comparison `splats`


def stop(text, status=2):
    print(f"compare_gsplat: {text}", file=sys.stderr)
    sys.exit(status)


# ---- COLMAP ----

def rotation_of(w, x, y, z):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def lines_of(path):
    return [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]


def unpack(file, layout):
    layout = "<" + layout
    return struct.unpack(layout, file.read(struct.calcsize(layout)))


def name_in(file):
    name = b""
    while (one := file.read(1)) not in (b"\0", b""):
        name += one
    return name.decode()


def read_cameras(folder):
    """{id: (model, width, height, parameters)}"""
    cameras = {}
    if (folder / "cameras.bin").exists():
        with (folder / "cameras.bin").open("rb") as file:
            for _ in range(unpack(file, "Q")[0]):
                number, model, width, height = unpack(file, "IiQQ")
                if model >= len(MODEL_NAMES):
                    stop(f"{folder}: a camera of COLMAP's model {model}; only pinhole cameras can be compared")
                name = MODEL_NAMES[model]
                cameras[number] = (name, width, height, unpack(file, f"{CAMERA_PARAMETERS[name]}d"))
    else:
        for words in filter(None, lines_of(folder / "cameras.txt")):
            if words[1] not in CAMERA_PARAMETERS:
                stop(f"{folder}: a camera of the model {words[1]}; only pinhole cameras can be compared")
            cameras[int(words[0])] = (words[1], int(words[2]), int(words[3]), tuple(map(float, words[4:])))
    return cameras


def read_images(folder):
    """[(name, camera's id, quaternion, translation)]"""
    images = []
    if (folder / "images.bin").exists():
        with (folder / "images.bin").open("rb") as file:
            for _ in range(unpack(file, "Q")[0]):
                values = unpack(file, "I7dI")
                name = name_in(file)
                file.seek(24 * unpack(file, "Q")[0], 1)
                images.append((name, values[8], values[1:5], values[5:8]))
    else:
        # Two lines an image; the second may be empty.
        for words in lines_of(folder / "images.txt")[::2]:
            if words:
                images.append((words[9], int(words[8]), tuple(map(float, words[1:5])), tuple(map(float, words[5:8]))))
    return images


def read_points(folder):
    """[(x, y, z, red, green, blue)], colours from 0 to 255."""
    points = []
    if (folder / "points3D.bin").exists():
        with (folder / "points3D.bin").open("rb") as file:
            for _ in range(unpack(file, "Q")[0]):
                values = unpack(file, "Q3d3Bd")
                file.seek(8 * unpack(file, "Q")[0], 1)
                points.append(values[1:7])
    else:
        for words in filter(None, lines_of(folder / "points3D.txt")):
            points.append((*map(float, words[1:4]), *map(int, words[4:7])))
    return points


def read_dataset(dataset):
    """(views in name order, points)"""
    folder = dataset / "sparse/0"
    if not folder.is_dir():
        stop(f"{dataset}: there is no folder sparse/0; only COLMAP datasets can be compared")
    cameras, views = read_cameras(folder), []
    for name, number, quaternion, translation in read_images(folder):
        _, width, height, parameters = cameras[number]
        focal = (parameters[0], parameters[-3])  # SIMPLE_PINHOLE has f cx cy, PINHOLE fx fy cx cy
        length = math.sqrt(sum(q * q for q in quaternion))
        views.append(View(name, rotation_of(*(q / length for q in quaternion)), translation, width, height, focal, parameters[-2:]))
    return sorted(views), read_points(folder)


# ---- ewa ----

def train_ewa(options, run, output):
    command = [options.ewa, "train", options.dataset, "-o", output, "--steps", run.steps, "--strategy", run.strategy,
               "--sh-degree", SH_DEGREE, "--test-every", TEST_EVERY, "--seed", options.seed, "--quiet"]
    if run.first:
        command += ["--init", run.first, "--sh-degree-every", 1, "--max-splats", 10**9]
    else:
        command += ["--max-splats", options.max_splats]
    if options.device:
        command += ["--device", options.device]
    try:
        ran = subprocess.run(list(map(str, command)), stderr=subprocess.PIPE, text=True)
    except OSError as error:
        stop(f"{options.ewa}: {error.strerror}; scripts/build makes it", 1)
    if ran.returncode != 0:
        stop(f"ewa ended with status {ran.returncode}: {ran.stderr.strip()}", 1)
    summary = json.loads((output / "summary.json").read_text())
    return Figures(run.comparison, "ewa", summary["device"], run.steps, summary["splats"], summary["seconds"],
                   1e3 * summary["seconds_per_step"], summary["test_psnr"], summary["peak_device_bytes"] / 2**20)


def read_splats(path):
    """{property: values} of a PLY file of floats, as ewa writes it."""
    with path.open("rb") as file:
        names, count, line = [], 0, b""
        while line != b"end_header":
            line = file.readline().strip()
            words = line.decode().split()
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            elif words[:1] == ["property"]:
                if words[1] != "float":
                    stop(f"{path}: the property {words[2]} is no float", 1)
                names.append(words[2])
        values = array.array("f")
        values.fromfile(file, count * len(names))
    if sys.byteorder == "big":
        values.byteswap()
    return {name: values[i::len(names)] for i, name in enumerate(names)}


# ---- gsplat ----

def load_gsplat():
    """The modules, or the end of the script."""
    try:
        import numpy, torch
        from PIL import Image
        import gsplat
        from gsplat.optimizers import SelectiveAdam
        from gsplat.strategy import DefaultStrategy, MCMCStrategy
    except ImportError as error:
        stop(f"gsplat's half needs the Python packages gsplat, torch, numpy and pillow: {error}; --only ewa does without")
    if not torch.cuda.is_available():
        stop("gsplat's half needs a CUDA device, and torch finds none; --only ewa does without")
    return argparse.Namespace(numpy=numpy, torch=torch, Image=Image, gsplat=gsplat, SelectiveAdam=SelectiveAdam,
                              DefaultStrategy=DefaultStrategy, MCMCStrategy=MCMCStrategy)


def fused_ssim_module():
    """fused_ssim, or fussim under that name, which gsplat itself may import too. None without both."""
    try:
        import fused_ssim
    except ImportError:
        try:
            import fussim
        except ImportError:
            return None
        sys.modules["fused_ssim"] = fussim
    return sys.modules["fused_ssim"]


def ssim_function(torch, choice):
    """(mean SSIM of two images of shape 1, 3, height, width over the pixels whose window is in the image, its name)"""
    module = fused_ssim_module() if choice == "fused" else None
    if module:
        def fused(a, b):
            return module.fused_ssim(a, b, padding="valid")
        try:  # a wheel of another CUDA or PyTorch fails here
            some = torch.rand(1, 3, 32, 32, device="cuda", requires_grad=True)
            fused(some, some.detach()).backward()
            return fused, f"{module.__name__} {getattr(module, '__version__', '')}".strip()
        except (ImportError, OSError, RuntimeError, TypeError) as error:
            print(f"compare_gsplat: {module.__name__} does not work here: {error}", file=sys.stderr)
    at = torch.arange(11, device="cuda", dtype=torch.float32) - 5
    line = torch.exp(-at**2 / (2 * 1.5**2))
    window = torch.outer(line, line)
    window = (window / window.sum()).expand(3, 1, 11, 11).contiguous()

    def ssim(a, b):
        blur = lambda image: torch.nn.functional.conv2d(image, window, groups=3)
        mean_a, mean_b = blur(a), blur(b)
        var_a, var_b, both = blur(a * a) - mean_a**2, blur(b * b) - mean_b**2, blur(a * b) - mean_a * mean_b
        c1, c2 = 0.01**2, 0.03**2
        return ((2 * mean_a * mean_b + c1) * (2 * both + c2) / ((mean_a**2 + mean_b**2 + c1) * (var_a + var_b + c2))).mean()
    return ssim, "convolutions"


class GsplatTrainer:
    def __init__(self, modules, options, run, views, points):
        self.m, self.options, self.plan = modules, options, run
        self.torch = self.m.torch
        gc.collect()
        self.torch.cuda.empty_cache()
        self.torch.cuda.reset_peak_memory_stats()
        self.torch.manual_seed(options.seed)
        self.views = [self.on_device(view) for view in views]
        centres = self.torch.stack([-pose[:3, :3].T @ pose[:3, 3] for _, pose, *_ in self.views])
        self.scene_scale = 1.1 * (centres - centres.mean(0)).norm(dim=1).max().item()
        self.parameters = self.splats_of(run.first) if run.first else self.first_splats(points)
        self.optimizers = {key: self.optimizer([{"params": value, "lr": self.rate(key), "name": key}])
                           for key, value in self.parameters.items()}
        steps = run.steps
        self.schedule = self.torch.optim.lr_scheduler.ExponentialLR(self.optimizers["means"], gamma=MEAN_DECAY ** (1 / steps))
        self.strategy = {"adc": lambda: self.m.DefaultStrategy(refine_stop_iter=min(15000, steps // 2), verbose=False),
                         "mcmc": lambda: self.m.MCMCStrategy(cap_max=options.max_splats, verbose=False),
                         "none": lambda: None}[run.strategy]()
        if self.strategy:
            self.strategy.check_sanity(self.parameters, self.optimizers)
            self.state = (self.strategy.initialize_state(scene_scale=self.scene_scale) if run.strategy == "adc"
                          else self.strategy.initialize_state())
        self.ssim, self.ssim_name = ssim_function(self.torch, options.ssim)

    def rate(self, key):
        return MEAN_RATE * self.scene_scale if key == "means" else RATES[key]

    def optimizer(self, groups):
        if self.options.adam == "selective":
            return self.m.SelectiveAdam(groups, eps=1e-15, betas=(0.9, 0.999))
        return self.torch.optim.Adam(groups, eps=1e-15, fused=True if self.options.adam == "fused" else None)

    def on_device(self, view):
        """(image of 0 to 1, world to camera, intrinsics, width, height)"""
        image = self.m.Image.open(self.options.dataset / "images" / view.name).convert("RGB")
        pixels = self.torch.from_numpy(self.m.numpy.asarray(image).copy()).cuda()
        height, width = pixels.shape[:2]
        scale_x, scale_y = width / view.width, height / view.height
        pose = self.torch.eye(4)
        pose[:3, :3], pose[:3, 3] = self.torch.tensor(view.rotation), self.torch.tensor(view.translation)
        intrinsics = self.torch.tensor([[view.focal[0] * scale_x, 0, view.centre[0] * scale_x],
                                        [0, view.focal[1] * scale_y, view.centre[1] * scale_y], [0, 0, 1]])
        return pixels, pose.cuda(), intrinsics.cuda(), width, height

    def first_splats(self, points):
        torch = self.torch
        values = torch.tensor(points, dtype=torch.float32, device="cuda")
        means, colors = values[:, :3].contiguous(), values[:, 3:] / 255
        count = len(means)
        # Of each point, the root mean square distance to its three nearest neighbours.
        distances = torch.cat([torch.cdist(part, means).topk(4, largest=False).values[:, 1:] for part in means.split(1024)])
        spacing = (distances**2).mean(1).sqrt().clamp(min=1e-7)
        opacity, factor = (0.5, 0.1) if self.plan.strategy == "mcmc" else (0.1, 1.0)
        first = {"means": means, "scales": (factor * spacing).log()[:, None].repeat(1, 3), "quats": torch.rand(count, 4, device="cuda"),
                 "opacities": torch.full((count,), math.log(opacity / (1 - opacity)), device="cuda"),
                 "sh0": ((colors - 0.5) / SH_C0)[:, None], "shN": torch.zeros(count, (SH_DEGREE + 1) ** 2 - 1, 3, device="cuda")}
        return self.as_parameters(first)

    def splats_of(self, path):
        columns = read_splats(path)
        names = {"means": ["x", "y", "z"], "scales": [f"scale_{i}" for i in range(3)], "quats": [f"rot_{i}" for i in range(4)],
                 "sh0": [f"f_dc_{i}" for i in range(3)], "shN": [f"f_rest_{i}" for i in range(3 * ((SH_DEGREE + 1) ** 2 - 1))],
                 "opacities": ["opacity"]}
        first = {key: self.torch.stack([self.torch.frombuffer(columns[name], dtype=self.torch.float32) for name in of], 1).cuda()
                 for key, of in names.items()}
        count = len(first["means"])
        # The file has all coefficients of red before those of green and blue.
        return self.as_parameters(first | {"opacities": first["opacities"][:, 0], "sh0": first["sh0"][:, None],
                                           "shN": first["shN"].reshape(count, 3, -1).transpose(1, 2)})

    def as_parameters(self, values):
        return self.torch.nn.ParameterDict({key: self.torch.nn.Parameter(value.contiguous()) for key, value in values.items()})

    def render(self, view, degree):
        _, pose, intrinsics, width, height = view
        p = self.parameters
        images, _, info = self.m.gsplat.rasterization(
            means=p["means"], quats=p["quats"], scales=self.torch.exp(p["scales"]), opacities=self.torch.sigmoid(p["opacities"]),
            colors=self.torch.cat([p["sh0"], p["shN"]], 1), viewmats=pose[None], Ks=intrinsics[None], width=width, height=height,
            sh_degree=degree, packed=False)
        return images, info

    def step(self, number, view):
        image, info = self.render(view, SH_DEGREE if self.plan.first else min(number // SH_DEGREE_EVERY, SH_DEGREE))
        adc = self.plan.strategy == "adc"
        if adc:
            self.strategy.step_pre_backward(self.parameters, self.optimizers, self.state, number, info)
        target = view[0][None].float() / 255
        loss = (1 - SSIM_WEIGHT) * (image - target).abs().mean() + SSIM_WEIGHT * (
            1 - self.ssim(image.permute(0, 3, 1, 2), target.permute(0, 3, 1, 2)))
        if self.plan.strategy == "mcmc":
            loss = loss + 0.01 * self.torch.sigmoid(self.parameters["opacities"]).mean() + 0.01 * self.torch.exp(
                self.parameters["scales"]).mean()
        loss.backward()
        seen = [(info["radii"] > 0).all(-1).any(0)] if self.options.adam == "selective" else []
        for optimizer in self.optimizers.values():
            optimizer.step(*seen)
            optimizer.zero_grad(set_to_none=True)
        self.schedule.step()
        if adc:
            self.strategy.step_post_backward(self.parameters, self.optimizers, self.state, number, info, packed=False)
        elif self.strategy:
            self.strategy.step_post_backward(self.parameters, self.optimizers, self.state, number, info, lr=self.schedule.get_last_lr()[0])

    def psnr(self, views):
        values = []
        with self.torch.no_grad():
            for view in views:
                image = self.render(view, SH_DEGREE)[0][0].clamp(0, 1)
                values.append(-10 * math.log10((image - view[0].float() / 255).square().mean().item()))
        return sum(values) / len(values)

    def run(self):
        training = [view for i, view in enumerate(self.views) if i % TEST_EVERY]
        held_out, order, chance = self.views[::TEST_EVERY], [], random.Random(self.options.seed)
        with self.torch.no_grad():
            self.render(held_out[0], SH_DEGREE)  # gsplat may compile its kernels at the first use
        self.torch.cuda.synchronize()
        start = time.monotonic()
        for number in range(self.plan.steps):
            if not order:
                order = chance.sample(range(len(training)), len(training))
            self.step(number, training[order.pop()])
        self.torch.cuda.synchronize()
        seconds = time.monotonic() - start
        memory = self.torch.cuda.max_memory_allocated() / 2**20
        return Figures(self.plan.comparison, f"gsplat {self.m.gsplat.__version__}", self.torch.cuda.get_device_name(), self.plan.steps,
                       len(self.parameters["means"]), seconds, 1e3 * seconds / self.plan.steps, self.psnr(held_out), memory)


# ---- both ----

def as_long_as(seconds, known, train):
    """train(steps) with the steps that take about as many seconds, from a row of other steps.

    Later steps may have more splats. So the seconds are taken for a power of the steps, which the last two runs give."""
    rows, power = [known], 1
    while len(rows) < 4:
        steps = max(1, round(rows[-1].steps * (seconds / rows[-1].seconds) ** (1 / power)))
        rows.append(train(steps))
        if abs(rows[-1].seconds / seconds - 1) < 0.05:
            break
        if rows[-1].steps != rows[-2].steps:
            slope = math.log(rows[-1].seconds / rows[-2].seconds) / math.log(rows[-1].steps / rows[-2].steps)
            power = min(max(slope, 0.5), 3)
    return min(rows[1:], key=lambda row: abs(math.log(row.seconds / seconds)))


def compare(options, views, points):
    """(the table's rows, what gsplat used)"""
    rows, used = [], {}
    modules = load_gsplat() if options.only != "ewa" else None

    def gsplat(run):
        trainer = GsplatTrainer(modules, options, run, views, points)
        used.update(gsplat=modules.gsplat.__version__, torch=modules.torch.__version__, ssim=trainer.ssim_name, adam=options.adam)
        return trainer.run()

    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        first = Run("steps", options.steps, options.strategy)
        theirs = gsplat(first) if modules else None
        ours = train_ewa(options, first, folder / "steps") if options.only != "gsplat" else None
        if "steps" in options.compare:
            rows += [theirs, ours]
        if "seconds" in options.compare and theirs and ours:
            rows += [as_long_as(ours.seconds, theirs, lambda steps: gsplat(Run("seconds", steps, options.strategy))),
                     ours._replace(comparison="seconds")]
        if "splats" in options.compare and ours:
            run = Run("splats", min(options.steps, SPLATS_STEPS), "none", folder / "steps/splats.ply")
            rows += [gsplat(run) if modules else None, train_ewa(options, run, folder / "splats")]
    return [row for row in rows if row], used


def differences(rows, used):
    """What is not equal."""
    lines = ["Each trainer has its own rates, thresholds and schedules. Those of gsplat belong to 30,000 steps; refinement of adc ends "
             "at half of the steps, that of mcmc at 25,000.",
             "SSIM: gsplat's windows are within the image, ewa's have zeros beyond it.",
             "Memory: gsplat's is what PyTorch allocated, ewa's what it took from the driver."]
    if used.get("ssim") == "convolutions":
        lines.append("gsplat's SSIM is by convolutions: fused_ssim and fussim are missing or do not work.")
    if used.get("adam") == "selective":
        lines.append("gsplat's Adam updates visible splats alone, ewa's all.")
    for comparison in COMPARISONS:
        pair = [row for row in rows if row.comparison == comparison]
        if len(pair) != 2:
            continue
        for what in ("steps", "splats", "seconds"):
            theirs, ours = (getattr(row, what) for row in pair)
            if abs(theirs / ours - 1) > (0.05 if what == "seconds" else 0):
                lines.append(f"{comparison}: gsplat's {what} are {theirs / ours:.2f} of ewa's.")
        if comparison == "splats":
            lines.append("splats: both continue from ewa's splats, with the rates of a first step.")
    return lines


def print_table(rows, options, used, unequal):
    versions = ", ".join(f"{name} {used[name]}" for name in ("torch", "ssim", "adam") if name in used)
    print(f"{options.dataset.name}, {options.steps} steps, {options.strategy}, at most {options.max_splats:,} splats, SH {SH_DEGREE}"
          + (f"; {versions}" if versions else "") + "\n")
    print("| equal | trainer | device | steps | splats at the end | seconds | ms a step | held-out PSNR | device memory |")
    print("|---|---|---|--:|--:|--:|--:|--:|--:|")
    for row in rows:
        print(f"| {row.comparison} | {row.trainer} | {row.device} | {row.steps:,} | {row.splats:,} | {row.seconds:.1f} | {row.step_ms:.3f} "
              f"| {row.psnr:.2f} dB | {row.device_mib:,.0f} MiB |")
    print("\nNot equal:" if unequal else "")
    for line in unequal:
        print(f"- {line}")


def main():
    parser = argparse.ArgumentParser(description="Trains the same images with gsplat and with ewa.")
    parser.add_argument("dataset", type=pathlib.Path)
    parser.add_argument("--steps", type=int, default=7000)
    parser.add_argument("--compare", default=",".join(COMPARISONS), help="what is equal: steps,seconds,splats [all]")
    parser.add_argument("--strategy", choices=("adc", "mcmc", "none"), default="adc")
    parser.add_argument("--max-splats", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=("ewa", "gsplat"))
    parser.add_argument("--adam", choices=("fused", "selective", "plain"), default="fused", help="gsplat's optimizer [fused]")
    parser.add_argument("--ssim", choices=("fused", "convolutions"), default="fused", help="gsplat's SSIM [fused, where it is there]")
    parser.add_argument("--ewa", default=EWA, help="the program [build/release/ewa]")
    parser.add_argument("--device", help="ewa's device, see ewa devices")
    parser.add_argument("--json", type=pathlib.Path, help="also write the figures to this file")
    options = parser.parse_args()
    options.compare = options.compare.split(",")
    if unknown := set(options.compare) - set(COMPARISONS):
        stop(f"--compare: {', '.join(sorted(unknown))} is none of {', '.join(COMPARISONS)}")
    if options.steps < 1:
        stop("--steps must be at least 1")
    views, points = read_dataset(options.dataset)
    if not views or not points:
        stop(f"{options.dataset}: {len(views)} images and {len(points)} points; both are needed")
    possible = {None: COMPARISONS, "ewa": ("steps", "splats"), "gsplat": ("steps",)}[options.only]
    if not set(options.compare) & set(possible):
        stop(f"--only {options.only}: {', '.join(options.compare)} needs the other trainer")
    rows, used = compare(options, views, points)
    unequal = differences(rows, used) if options.only is None else []
    print_table(rows, options, used, unequal)
    if options.json:
        options.json.write_text(json.dumps({
            "schema": "ewa-compare-1", "dataset": options.dataset.name, "steps": options.steps, "strategy": options.strategy,
            "max_splats": options.max_splats, "used": used, "rows": [row._asdict() for row in rows], "not_equal": unequal}) + "\n")


if __name__ == "__main__":
    main()
