# SPDX-License-Identifier: Apache-2.0
"""The commands of COLMAP that ewa uses, by COLMAP's Python package: python3 -c TEXT COMMAND --OPTION VALUE ...

Commands and options have the names of the program colmap. --help lists a command's options: those that this release of the package has."""
import sys

sys.path[:] = filter(None, sys.path)  # the current folder may have another module of this name
import pathlib
import shutil

import pycolmap as colmap


def feature_extractor(given, reader, extraction):
    single = given.get("ImageReader.single_camera") == "1"
    colmap.extract_features(
        given["database_path"], given["image_path"],
        pathlib.Path(given["image_list_path"]).read_bytes().splitlines(),  # names may be of any bytes
        colmap.CameraMode.SINGLE if single else colmap.CameraMode.AUTO, reader, extraction, colmap.Device.cpu)


def matches_importer(given, matching):
    pairs = colmap.ImportedPairingOptions()
    pairs.match_list_path = given["match_list_path"]
    colmap.match_image_pairs(given["database_path"], matching, pairs, device=colmap.Device.cpu)


def exhaustive_matcher(given, matching):
    colmap.match_exhaustive(given["database_path"], matching, device=colmap.Device.cpu)


def mapper(given, options):
    if "default_random_seed" in given:
        options.random_seed = int(given["default_random_seed"])
    output = pathlib.Path(given["output_path"])
    models = colmap.incremental_mapping(given["database_path"], given["image_path"], output, options,
                                        given.get("input_path", ""))
    if not models:
        sys.exit("no first pair was found")
    if "input_path" in given:  # the model has no folder of its own
        shutil.rmtree(output / "0", ignore_errors=True)
        models[0].write(output)


def point_triangulator(given, options):
    colmap.triangulate_points(colmap.Reconstruction(given["input_path"]), given["database_path"], given["image_path"],
                              given["output_path"], given["clear_points"] == "1", options)


def bundle_adjuster(given, options):
    model = colmap.Reconstruction(given["input_path"])
    colmap.bundle_adjustment(model, options)
    model.write(given["output_path"])


def point_filtering(given):
    model = colmap.Reconstruction(given["input_path"])
    colmap.ObservationManager(model).filter_all_points3D(4.0, 1.5)  # px, degrees: the defaults of the program
    model.write(given["output_path"])


def add_images(model, other):
    for image in other.images.values():
        if not model.exists_image(image.image_id):
            if not model.exists_camera(image.camera_id):
                model.add_camera_with_trivial_rig(image.camera)
            pose = image.cam_from_world()
            image = colmap.Image(image.name, [point.xy for point in image.points2D], image.camera_id, image.image_id)
            model.add_image_with_trivial_frame(image, pose)


def model_merger(given):
    """As the program: a point of the second model joins one of the first where they share a feature."""
    model, other = (colmap.Reconstruction(given[f"input_path{i}"]) for i in (1, 2))
    similarity = colmap.align_reconstructions_via_reprojections(other, model, max_reproj_error=64.0)
    if similarity is None:
        sys.exit("the models cannot be aligned")
    other.transform(similarity)
    add_images(model, other)
    for point in other.points3D.values():
        feature = {(each.image_id, each.point2D_idx): each for each in point.track.elements}
        points = {at: model.images[at[0]].points2D[at[1]] for at in feature}
        track = colmap.Track([each for at, each in feature.items() if not points[at].has_point3D()])
        known = {each.point3D_id for each in points.values() if each.has_point3D()}
        if track.length() >= 2 or (len(feature) >= 2 and len(known) == 1):
            number = model.add_point3D(point.xyz, track, point.color)
            if len(known) == 1:
                model.merge_points3D(number, known.pop())
    model.write(given["output_path"])


# The functions of the commands, and the options that they take, by the first part of their names.
COMMANDS = {
    feature_extractor: {"ImageReader": "ImageReaderOptions", "FeatureExtraction": "FeatureExtractionOptions"},
    matches_importer: {"FeatureMatching": "FeatureMatchingOptions"},
    exhaustive_matcher: {"FeatureMatching": "FeatureMatchingOptions"},
    mapper: {"Mapper": "IncrementalPipelineOptions"},
    point_triangulator: {"Mapper": "IncrementalPipelineOptions"},
    bundle_adjuster: {"BundleAdjustment": "BundleAdjustmentOptions"},
    model_merger: {},
    point_filtering: {},
}
INSIDE = ("sift", "mapper", "triangulation", "ceres", "solver_options")  # options that have a place inside others
OF_FUNCTIONS = {"ImageReader.single_camera", "default_random_seed"}


def fields_of(options):
    """{name: the options with the field of this name}, also of those inside"""
    fields = {}
    for name in INSIDE:
        if hasattr(options, name):
            fields |= fields_of(getattr(options, name))
    return fields | {name: options for name in dir(options) if not name.startswith("_")}


def main(command, *words):
    if command == "version":
        if not hasattr(colmap, "match_image_pairs"):  # of 4.0 and later
            sys.exit(f"pycolmap {colmap.__version__} is too old; pip install --upgrade pycolmap")
        return print("pycolmap", colmap.__version__)
    function = next((each for each in COMMANDS if each.__name__ == command), None)
    if function is None:
        sys.exit(f"pycolmap has no command {command}")
    groups = {group: getattr(colmap, name)() for group, name in COMMANDS[function].items()}
    fields = {group: fields_of(options) for group, options in groups.items()}
    if words == ("--help",):
        names = [f"{group}.{name}" for group in fields for name in fields[group]]
        return print(*(f"--{name} \n" for name in [*names, *OF_FUNCTIONS]), sep="")
    given = {name.removeprefix("--"): value for name, value in zip(words[::2], words[1::2])}
    for name, value in given.items():
        field = name.partition(".")[2]
        if not field or name in OF_FUNCTIONS:
            continue
        options = next((each[field] for each in fields.values() if field in each), None)
        if options is None:
            sys.exit(f"pycolmap {colmap.__version__} has no option {name}")
        kind = type(getattr(options, field))
        setattr(options, field, bool(int(value)) if kind is bool else kind(value))
    colmap.logging.logtostderr = True  # else it also writes files in the folder for temporary ones
    function(given, *groups.values())


main(*sys.argv[1:])
