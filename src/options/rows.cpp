// SPDX-License-Identifier: Apache-2.0
// The options that are not of training runs alone, and no edits. Sorted by name, positionals first.
#include "ewa/capture.h"
#include "ewa/gaussians.h"
#include "ewa/metrics.h"
#include "ewa/render_options.h"
#include "io/splats/format_table.h"
#include "options/option.h"
#include "run/option_table.h"
#include "scene/looks.h"

namespace ewa::options {
namespace {

/// The commands that draw splats as people choose.
constexpr const char* kDrawing = "render eval grad compare";

// What only some rows have.
constexpr auto kInput = [](Option& option) { option.role = Role::input; };
constexpr auto kWritten = [](Option& option) { option.role = Role::output; };
constexpr auto kRequired = [](Option& option) { option.is_required = true; };
constexpr auto kRepeats = [](Option& option) { option.repeats = true; };
constexpr auto kUsual = [](Option& option) { option.shows_usual = true; };
constexpr auto kCheckedAsInTrain = [](Option& option) { option.run = &train::run_option(option.name); };
auto within(double low, double high) {
    return [=](Option& option) { option.low = low, option.high = high; };
}
auto words(std::vector<std::string> all) {
    return [=](Option& option) { option.choices = all; };
}
auto brief(const char* text) {
    return [=](Option& option) { option.brief = text; };
}
auto spelled_also(const char* names) {
    return [=](Option& option) { option.also = names; };
}

template <class... Traits>
Option row(const char* name, const char* commands, const char* subject, const char* value,
           const std::string& help, const Traits&... traits) {
    Option option{name, commands, subject, value, help};
    (traits(option), ...);
    return option;
}

/// An option of a training run that these commands have, too.
template <class... Traits>
Option of_run(const char* name, const char* commands, const Traits&... traits) {
    return row(name, commands, "", "", "", traits...);
}

std::string splat_files() {
    return "Splat file (" + io::extension_list(io::Uses::read) + ")";
}

std::string metric_names() {
    std::string names;
    for (const Metric& metric : all_metrics()) names += (names.empty() ? "" : ", ") + metric.name;
    return names;
}

std::vector<Option> positionals() {
    return {
        row("A", "compare!", kData, "",
            "Image, folder of images, splat file, folder of a training run, or mesh", kInput, kRequired),
        row("B", "compare!", kData, "", "What A is compared with: image, folder, splat file, run or mesh",
            kInput, kRequired),
        row("DATASET", "eval grad", kData, "",
            "Images with cameras: a COLMAP folder or transforms.json. Or a glTF file of meshes, which is "
            "rendered as in ewa train. Or the folder of a training run: its dataset [that of the run SPLATS, "
            "with the run's options]",
            kInput),
        row("FILES", "convert!", kData, "IN... OUT",
            "One or more inputs, which are joined, then the output unless -o names it. Formats: " +
                io::extension_list(io::Uses::both) + ", inputs also " +
                io::extension_list(io::Uses::only_read) + ", and an output also " +
                io::extension_text(io::Uses::only_written) +
                ". A page shows the scene in a browser, and a tileset.json is of 3D Tiles. An input may be "
                "the folder of a training run. IN:STEP, as in b.ply:move=1,0,0, moves one input alone; more "
                "steps follow after more colons",
            kRequired, brief("One or more inputs, which are joined, then the output, unless -o names it")),
        row("INPUT", "cameras", kData, "",
            "Folder with photos (JPEG, PNG, TIFF or BMP), a video, or a folder with videos. COLMAP finds the "
            "cameras, ffmpeg reads the video; both must be installed",
            kInput, kRequired),
        row("PATH", "ewa-view", kData, "",
            splat_files() + ", dataset, folder of a training run, folder of photos, or video. Without it, "
                            "the window waits for a file",
            kInput),
        row("PATH", "info", kData, "",
            splat_files() +
                ", COLMAP folder, transforms.json, cameras of another program, zip archive of one of these, "
                "glTF file of meshes, image, folder of photos, video, or folder of a training run",
            kInput, kRequired),
        row("SCENE", "dataset", kData, "", "glTF file with meshes (.gltf .glb)", kInput, kRequired),
        row("SPLATS", "render! eval grad mesh", kData, "", splat_files() + ", or folder of a training run",
            kInput, kRequired, brief("Splat file, or folder of a training run")),
    };
}

std::vector<Option> from_a_to_o() {
    return {
        row("allow-empty", "convert", kOutput, "", "Write the output even if no splat is left"),
        row("aperture", "render", kData, "D",
            "Depth of field: diameter of the lens (world units). What is out of focus becomes blurred",
            within(1e-9, 1e9)),
        row("appearance-of", "render eval", kData, "NAME",
            "Training image whose appearance all images get [each its own, and new ones the mean]"),
        row("background", "render! eval grad compare!", kQuality, "COLOUR",
            "Background colour: r,g,b in 0..1, a name such as white, #rrggbb, or a sky.json [that beside "
            "SPLATS, if it is there]",
            kInput, kUsual, brief("Colour behind the splats, or a sky.json")),
        row("background", "ewa-view", kQuality, "COLOUR",
            "Background colour: r,g,b in 0..1, a name such as white, or #rrggbb"),
        row("bake-sky", "convert", kData, "",
            "Add opaque splats far away in place of the sky of the run: for viewers that have none"),
        row("blur-samples", "render", kQuality, "N",
            "Renders that --aperture and --shutter average for an image", within(2, 4096), kUsual),
        row("budget", "ewa-view", kQuality, "N",
            "Most splats to draw while the view changes: those that cover most, or a level of a "
            "lod-meta.json "
            "[1M; on a CPU 200k where there are no levels]",
            within(1, 4294967296.0)),
        row("cameras", "ewa-view", kData, "DATASET", "Dataset whose cameras to show and to look through",
            kInput),
        row("cameras", "compare!", kData, "DATASET",
            "Dataset whose cameras render splat files. Each render is compared with that of the other splat "
            "file, or with the image that has the name ewa render would give it, rounded like that image "
            "[the dataset of a run]",
            kInput, brief("Dataset whose cameras render splat files")),
        row("cameras", "mesh", kData, "DATASET",
            "Dataset whose cameras see the surfaces [that of the run; without a run, cameras all around the "
            "splats]",
            kInput),
        row("cameras", "render!", kData, "DATASET",
            "Dataset whose cameras to render through [that of a run], or a camera_path.json of nerfstudio. "
            "Without, the whole scene is shown from the front",
            kInput, brief("Dataset whose cameras to render through")),
        row("check", "convert!", kOutput, "",
            "Read the output back and print its error against the scene in memory, also as PSNR of renders",
            brief("Read the output back and print its error")),
        row("check-options", "train", kHidden, "", "Check the options and the dataset, and train nothing"),
        row("codec", "render", kOutput, "",
            "How a film is packed, if ffmpeg can: h264, hevc, av1 or vp9 [ffmpeg's choice for the name: h264 "
            "in .mp4]",
            words({"h264", "hevc", "av1", "vp9"})),
        row("collision", "mesh", kOutput, "",
            "A mesh for physics: closed, coarse, of at most 10,000 triangles, without colours"),
        row("compare", "ewa-view", kQuality, "", "Comparison with the image of the camera",
            words({"none", "beside", "wipe", "difference"})),
        row("config", "train!", kData, "FILE",
            "JSON with the names of these options, such as a run's config.json. The command line has "
            "precedence",
            kInput, brief("Options from a JSON file, such as a config.json")),
        row("connect", "ewa-view", kTraining, "HOST:PORT", "Show a training that runs with --serve"),
        row("depth", "eval", kOutput, "",
            "Compare the depth of the renders with the dataset's depth maps, too"),
        row("depth", "mesh", kQuality, "",
            "Where a pixel's surface is: at the median or the mean depth of its splats. auto: the mean if "
            "the run compared it with depth maps (--loss depth=W), else the median",
            words({"auto", "median", "mean"}), kUsual),
        of_run("device", "render! eval grad doctor dataset mesh compare! ewa-view"),
        row("distance", "compare", kOutput, "D",
            "Of two meshes (.gltf, .glb, .ply, .obj), of which B is the true one, or a scan (a .ply of "
            "points): points within this distance count in the F-score, in the scene's units [0.005 of B's "
            "diagonal]",
            within(1e-12, 1e12)),
        of_run("downscale", "render! eval grad mesh compare!"),
        row("dry-run", "convert", kEdits, "PICTURE",
            "Write only this picture, in which all that would be removed is red. OUT may be left out, and is "
            "not written. Edits that merge or sort splats are left out then",
            kWritten),
        row("edits", "convert", kEdits, "FILE",
            "Replay a journal of edits, which ewa-view keeps beside the splats as FILE.edits", kInput,
            [](Option& option) { option.repeats = true; }),
        row("exposure", "dataset", kData, "EV", "Exposure in stops, or auto", kUsual),
        row("exposures", "render eval", kData, "auto|none|FILE",
            "Appearance of training images, as ewa train --appearance writes it. auto: that of the run "
            "SPLATS, with its own dataset",
            kInput, kUsual),
        row("film", "ewa-view", kOutput, "DIR",
            "Write a film through the saved views, one PNG per frame, and exit"),
        row("film-seconds", "ewa-view", kOutput, "S",
            "Duration of the film from view to view [the times in the file, or 2]", within(0.04, 3600)),
        row("film-seconds", "render", kData, "S",
            "With --views: seconds from view to view [the times in the file, or 2]. A folder gets the frames "
            "of "
            "the film",
            within(0.04, 3600)),
        row("focus", "render", kData, "D",
            "Distance along the view that is sharp (world units) [that of what the middle of the image "
            "shows]",
            within(1e-9, 1e9)),
        row("force", "dataset", kOutput, "", "Replace DIR's views of another scene or of other options"),
        row("force", "train!", kOutput, "",
            "Replace the run in DIR. Without --resume or --force it is refused",
            brief("Replace the run in DIR")),
        row("format", "render!", kOutput, "",
            "Format in a folder: png, jpg (8 bit, clamped) or exr (float32, not clamped)",
            words({"png", "jpg", "exr"}), kUsual, brief("Format of the images in a folder")),
        row("frame", "ewa-view", kData, "I|NAME",
            "The camera to start from: its index in name order, or its name (0)"),
        row("frame", "grad", kData, "I|NAME",
            "The view: its index over all frames, in name order from 0, or its name", kRequired),
        row("frames", "cameras", kData, "N",
            "Number of frames to take from a video, or from all videos of a folder, about: the sharpest of "
            "each of as many equal parts",
            within(kFewestVideoFrames, kMostVideoFrames), kUsual),
        row("frames", "render! compare!", kData, "FRAMES",
            "all, train, test, names, or indices in name order such as 0,3 or 5-9", kUsual),
        row("geo", "convert", kData, "LAT,LON,HEIGHT[,HEADING]|ecef",
            "Where a tileset.json puts the scene, in degrees (WGS 84) and metres: x points east, z to the "
            "heading, which is north without it, and y down. Or ecef: the scene's coordinates are those of "
            "the earth"),
        row("gltf-spz", "convert", kOutput, "",
            "Pack the splats of a .glb or .gltf as SPZ (KHR_gaussian_splatting_compression_spz_2)"),
        row("heat-map", "compare!", kOutput, "OUT",
            "Write the error as an image (.png, .exr); for folders: one image per pair into this folder",
            brief("Write the error as an image, or as one per pair")),
        row("heat-scale", "compare", kOutput, "E", "Error that the heat map shows brightest",
            within(1e-9, 1e9), kUsual),
        row("integrator", kDrawing, kQuality, "",
            "How splats become a colour: splat blends footprints; fast-ray evaluates each splat on each ray, "
            "in the order of splat; ray orders them on each ray; march integrates the volume",
            words(core::words_of(scene::kIntegratorWords)), kUsual),
        row("json", "convert", kOutput, "FILE",
            "Write the inputs, the output, remarks and errors of --check to this file", kWritten),
        row("json", "devices info doctor", kOutput, "", "Print JSON"),
        row("json", "eval compare!", kOutput, "FILE", "Write the results to this file", kWritten),
        row("json", "grad", kOutput, "FILE", "Write loss, l1, ssim, frame (index) and name to this file",
            kWritten),
        row("kernel", "ewa-view", kQuality, "",
            "Footprint of a splat: peak (3DGS), antialias (Mip-Splatting) or density (EWA) [that of the "
            "scene]",
            words(core::words_of(scene::kKernelWords))),
        of_run("kernel", "render! eval grad compare!", brief("Footprint of a splat")),
        of_run("lens", kDrawing),
        row("level", "convert", kData, "N",
            "Level of the inputs to read, each a lod-meta.json. 0: the finest", within(0, 31)),
        of_run("level", "cameras"),
        row("levels", "convert!", kOutput, "N",
            "Levels of a lod-meta.json, tileset.json or --unbundled page, each with half of the splats of "
            "the one before; fewer where a tile would have less than 1,000 [until one has at most a million, "
            "or a tile 100,000]",
            within(1, 32), brief("Levels of a lod-meta.json, page or 3D Tiles")),
        row("look-at", "render!", kData, "x,y,z,X,Y,Z",
            "Look from x,y,z at X,Y,Z (world units). With --orbit: the first view"),
        of_run("loss", "grad"),
        of_run("masks", "eval grad"),
        row("matching", "cameras", kData, "",
            "Which photos to compare. unordered: each with each. sequence: each with those that follow it in "
            "the order of names. auto: those that look as if they showed the same things, up to 1,000 "
            "photos; sequence for more",
            words({"auto", "sequence", "unordered"}), kUsual),
        row("max-error", "compare!", kOutput, "E",
            "Exit with status 1 if two values, alpha included, differ by more, or if an image has no partner",
            within(0, 1e9), brief("Exit with status 1 if two values differ by more")),
        of_run("max-width", "render eval grad mesh compare"),
        row("metrics", "eval compare!", kOutput, "LIST",
            "Metrics beside PSNR and SSIM: all, bands, or some of " + metric_names() +
                ", with commas between them",
            kCheckedAsInTrain, brief("Metrics beside PSNR and SSIM, or all")),
        row("mode", "ewa-view", kQuality, "", "What to show; count is the splats per pixel",
            words({"color", "depth", "alpha", "count", "ellipsoids", "median-depth", "normal"})),
        row("mode", "render!", kOutput, "",
            "color, alpha, depth (mean view z; divided by its maximum in a png), median-depth (of the "
            "surface) or normal (of the surface, in world axes; from -1..1 to 0..1 in a png)",
            words({"color", "depth", "alpha", "median-depth", "normal"}), kUsual,
            brief("What the renders show")),
        of_run("nearest", kDrawing),
        row("orbit", "render!", kData, "N",
            "N views round the scene; a film shows 30 a second [240 for a film]", within(1, 100000),
            brief("N views round the scene")),
    };
}

/// --output of each command.
std::vector<Option> outputs() {
    std::vector<Option> all{
        row("output", "cameras", kOutput, "DIR",
            "Folder for the dataset: images/, sparse/0 and colmap/log.txt. An interrupted run continues "
            "there",
            kRequired),
        row("output", "convert!", kOutput, "OUT", "The output; all FILES are then inputs"),
        row("output", "dataset", kOutput, "DIR",
            "Folder for images/, depth/, points.ply and transforms.json. An interrupted run continues there",
            kRequired),
        row("output", "doctor", kOutput, "DIR", "Folder that a training would write to", kUsual),
        row("output", "ewa-view", kTraining, "DIR",
            "With --train: folder of the run [out/<name of the dataset>]"),
        row("output", "grad", kOutput, "OUT.ply",
            "PLY with the properties of a splat file; each holds the gradient dL/d(stored value). That of a "
            "density is by its own logit, not by the opacity that is stored for other programs",
            kWritten, kRequired),
        row("output", "mesh", kOutput, "OUT", "The mesh (.ply, .obj, .glb)", kWritten, kRequired),
        row("output", "render!", kOutput, "OUT",
            "Folder for the renders, named like the images of the dataset or by number. Or one image (.png, "
            ".jpg, .exr). Without --cameras, and of a camera_path.json, also a film (.mp4, .mov, .mkv, "
            ".webm) that the program ffmpeg writes",
            kUsual, brief("Folder for the renders, one image, or a film")),
        row("output", "train!", kOutput, "DIR",
            "Folder for splats.ply, summary.json, metrics.jsonl, report.html, config.json and checkpoint.ewa "
            "[out/<name of the dataset>]",
            brief("Folder of the run [out/<name of the dataset>]")),
    };
    for (Option& output : all) output.also = ",-o";
    return all;
}

std::vector<Option> from_p_to_z() {
    return {
        row("points", "dataset", kData, "N", "Points on the surfaces, for initial splats; 0: none",
            within(0, 10000000), kUsual),
        of_run("points", kDrawing),
        row("protocol", "eval", kOutput, "",
            "How images are compared. ewa: as they are. nerfbaselines, inria: as these round, composite and "
            "resize, for figures beside theirs",
            words({"ewa", "nerfbaselines", "inria"}), kUsual),
        row("quality", "train!", kQuality, "",
            "low: 2000 steps. medium: 7000. high: 30000, the default. --steps goes before it",
            words(core::words_of(train::kQualities)), brief("Steps of the run: 2000, 7000 or 30000")),
        row("quiet", "train render! convert! dataset cameras mesh", kOutput, "", "Print only errors"),
        row("resume", "train!", kOutput, "",
            "Continue the run in DIR, which DATASET may also name, from its checkpoint.ewa, or start if "
            "there is none. The run keeps its options; more --steps than before train it further",
            brief("Continue the run in DIR from its checkpoint")),
        row("rolling-shutter", "dataset", kData, "SHUTTER",
            "A rolling shutter of all cameras, as DIRECTION:DEGREES[,PERCENT]. The directions are "
            "top-to-bottom, bottom-to-top, left-to-right and right-to-left. During the readout each camera "
            "turns by DEGREES and moves by PERCENT of its distance to the scene, in directions of its own"),
        row("samples", "dataset", kQuality, "N", "Paths per pixel", within(1, 65536), kUsual),
        row("samples", kDrawing, kQuality, "N", "Intervals of a ray, with --integrator march (64)",
            within(1, kMostSamples)),
        row("scale-to", "mesh", kData, "x,y,z,X,Y,Z,LENGTH",
            "Scale the mesh until these two points of the scene are LENGTH apart; they are its points before "
            "--transform. ewa-view measures points"),
        row("screenshot", "ewa-view", kOutput, "FILE",
            "Write what the window shows, without the panel, as a PNG, and exit", kWritten),
        of_run("seed", "dataset"),
        row("serve", "train!", kOutput, "[ADDRESS:]PORT",
            "Let browsers, ewa-view and HTTP clients watch by this port (0: any free port). Only this "
            "machine "
            "can connect, unless an address stands before the port. Pausing and saving need the token in "
            "DIR/live.json",
            brief("Let browsers and ewa-view watch by this port")),
        row("sh-degree", kDrawing, kQuality, "0..3", "Highest degree of the spherical harmonics",
            within(0, kMaxShDegree), kUsual),
        row("shutter", "render", kData, "0..1",
            "Motion blur of films, orbits and paths: the share of a frame's time that the shutter is open; "
            "0.5 is usual",
            within(0.01, 1)),
        row("size", "dataset", kData, "WxH",
            "Width and height in pixels [256x256, for equirectangular 256x128]"),
        row("size", "ewa-view", kOutput, "WxH",
            "Size of the window in px [that of the last session, or panel and picture as large as fits]"),
        row("size", "render!", kData, "WxH",
            "Size of the renders in px, or of a screen: 720p, 1080p, 1440p, 4k, 8k [1280x720, or that of the "
            "saved view]",
            brief("Size of the renders, px, or 720p, 1080p, 4k")),
        row("sky", "dataset", kData, "", "Show the sky in the images, which else are transparent there"),
        row("split", "eval", kData, "", "Frames to evaluate: test, train or all",
            words({"test", "train", "all"}), kUsual),
        row("spz-version", "convert!", kOutput, "",
            "SPZ version of an .spz: 3 (every reader supports it) or 4 (newer, smaller files) [3]",
            words({"3", "4"}), brief("SPZ version of an .spz")),
        of_run("steps", "", spelled_also(",--iterations,--iters")),
        of_run("test-every", "render eval info compare"),
        row("threshold", "compare!", kOutput, "PSNR",
            "Exit with status 1 if the PSNR of an image is lower, over RGB in 0..1 or over all values with "
            "alpha, or if an image has no partner",
            within(0, 1000), brief("Exit with status 1 if the PSNR is lower")),
        row("through", "render! dataset", kData, "LENS",
            std::string("Lens to render through, in place of a pinhole: ") + kLensForms,
            brief("fisheye[:DEGREES], equirectangular, orthographic or opencv:K1,...")),
        row("title", "convert", kOutput, "TEXT", "Title of a page [the name of its file]"),
        row("token", "ewa-view", kTraining, "TEXT",
            "With --connect: allows pause and save. live.json in the folder of the run holds it. Other users "
            "see it in the list of processes; --token-file and the variable EWA_TOKEN do not show it"),
        row("token-file", "ewa-view", kTraining, "FILE",
            "With --connect: a file with the token, such as a copy of live.json"),
        row("train", "ewa-view", kTraining, "",
            "Train on the dataset, photos or video, and watch. Other options are passed to ewa train, such "
            "as --steps"),
        row("transform", "mesh", kData, "STEP",
            "Of the mesh: move=x,y,z, turn=x,y,z,degrees, scale=s, or a matrix of 12 or 16 numbers, row by "
            "row. Repeat the option for several steps, applied in order. Axes are those of a PLY: y down, z "
            "forward",
            kRepeats),
        row("transparent", "render!", kOutput, "",
            "No background: a png has alpha, and an exr colour over black", brief("No background")),
        row("triangles", "mesh", kOutput, "N",
            "At most this many triangles, where the surface needs no more to hang together [all]",
            within(4, 1000000000)),
        row("unbounded", "mesh", kOutput, "",
            "Also mesh the background, with voxels that grow with the distance from what the cameras look "
            "at"),
        row("unbundled", "convert", kOutput, "",
            "Write the scene of a page NAME.html beside it, as NAME-levels/lod-meta.json, of which a web "
            "server gives the browser what a view needs"),
        row("up", "mesh", kData, "AXIS",
            "Axis of the scene that becomes y in a .glb or .obj: x, y, z, or the opposite [-y, as for splats "
            "in a .glb]"),
        row("up", "render", kData, "AXIS",
            "Axis that points up: x, y, z, or the opposite such as --up=-y [guessed: -y unless the ground "
            "says otherwise; a run's cameras]"),
        row("validation", "train render eval grad doctor dataset mesh compare", kDevelopers, "",
            "Enable the Vulkan validation layer"),
        row("vary-appearance", "dataset", kData, "",
            "Give each image an exposure and colours of its own, and the camera a vignette and a response. "
            "DIR/appearance.json has them"),
        row("verbose", "ewa-view", kOutput, "",
            "At the end, print the time of the first frame and the frame rate of the moving camera"),
        row("verbose", "info", kOutput, "",
            "Also print the work that rendering and training skip, and each photo of a dataset"),
        row("verbose", "train", kOutput, "", "Print the plan: what this scene does not need"),
        row("views", "convert", kOutput, "FILE",
            "Keys of a film, in the format that ewa-view writes, which a page plays", kInput),
        row("views", "dataset", kData, "N",
            "Number of cameras on a dome over the scene; 0: the cameras of the file [those of the file if it "
            "has 8 or more, else 48]",
            within(0, 100000)),
        row("views", "ewa-view", kData, "FILE", "Saved views, in the format that the window writes", kInput),
        row("views", "render!", kData, "FILE",
            "Saved views, in the format that ewa-view writes. A folder gets one image of each view, a film "
            "goes from each view to the next",
            kInput, brief("Saved views of ewa-view; a film goes through them")),
        row("voxel", "mesh", kOutput, "SIZE",
            "Distance of the mesh's vertices, in the scene's units [two pixels on the surfaces]",
            within(1e-12, 1e12)),
    };
}

}  // namespace

std::vector<Option> rows() {
    std::vector<Option> all = positionals();
    for (const std::vector<Option>& more : {from_a_to_o(), outputs(), from_p_to_z()})
        all.insert(all.end(), more.begin(), more.end());
    return all;
}

}  // namespace ewa::options
