// SPDX-License-Identifier: Apache-2.0
// Photos without cameras, and videos, become datasets: ffmpeg extracts frames, and COLMAP finds the cameras. ewa runs both as
// separate programs.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ewa/image.h"

namespace ewa {

/// Which pairs of images COLMAP compares.
enum class Matching {
    automatic,  // those that look as if they showed the same things, up to 1,000 images; else sequence. 360° photos: unordered up to 50
    sequence,   // each image with those that follow it in the order of names
    unordered   // all pairs; the time grows with the square of their number
};

/// Limits of CaptureOptions::frames.
inline constexpr int kFewestVideoFrames = 3, kMostVideoFrames = 100000;

/// Options of make_dataset.
struct CaptureOptions {
    int frames =
        300;  // of a video, about: it is divided into as many equal parts, and each gives its sharpest frame
    Matching matching = Matching::automatic;
    bool level = true;                  // false: the world keeps COLMAP's axes
    std::filesystem::path python = {};  // that is first asked for pycolmap, where there is no program colmap
};

/// The phases of make_dataset, in this order. The phase `frames` occurs only with videos.
enum class CapturePhase { photos, frames, features, matches, cameras };

/// The progress of make_dataset.
struct CaptureProgress {
    CapturePhase phase = CapturePhase::photos;
    std::string what;  // a verb, such as "placed"
    std::string unit;  // the plural of what is counted, such as "photos"
    int done = 0, total = 0;
    std::string note;          // a line for the user, in one call only; usually empty
    double left = -1;          // s to the end of all phases; -1: not known before the first photo is searched
    double photo_seconds = 0;  // s in which COLMAP searches one photo for features; 0: not known
};

/// The outcome of make_dataset.
struct Capture {
    int images = 0;                       // that COLMAP received
    int placed = 0;                       // those for which COLMAP found a camera
    bool interrupted = false;             // true: the other members are not known
    std::vector<std::string> not_placed;  // names of images without a camera
    std::vector<std::string> remarks;     // for the user: a line each
    /// A line on the world's axes and scale. Empty: both are COLMAP's, or an earlier search has set them.
    std::string axes;
};

/// Whether the path is a video by its extension, a zip archive, or a folder of photos or videos without cameras, which
/// load_dataset does not read. It throws nothing.
bool is_capture(const std::filesystem::path& path);

/// Whether the dataset is made of frames: the path is a video by its extension, or a folder with videos and no photos.
bool has_videos(const std::filesystem::path& path);

/// Lines for the user about an input.
struct CaptureContents {
    std::string text;   // "8 photos"
    std::string masks;  // a line on the photos' masks; empty if there are none
};
/// Counts the photos or videos that make_dataset would take from a folder or video. Throws InputError: a folder that
/// cannot be read, HEIC that no program converts, a link that leads out of the folder.
CaptureContents capture_contents(const std::filesystem::path& path);

/// Whether the path is a zip archive by its extension and its first bytes.
bool is_archive(const std::filesystem::path& path);
/// Whether an archive has the files of a dataset. Throws InputError, also for an archive that make_dataset refuses.
bool archive_has_cameras(const std::filesystem::path& archive);
/// Unpacks an archive into a new folder. Returns that folder, or the one in it that has everything else. Throws InputError,
/// RunError.
std::filesystem::path unpack_archive(const std::filesystem::path& archive,
                                     const std::filesystem::path& folder);
/// Unpacks the dataset of an archive into a temporary folder, and calls `read` with it. The folder exists while the returned value
/// does. An InputError of `read` names the archive and the entry in place of the folder. Throws InputError for an archive without
/// cameras, and as unpack_archive does.
std::shared_ptr<const void> read_archive(
    const std::filesystem::path& archive,
    const std::function<void(const std::filesystem::path& folder)>& read);

/// The size of the smallest photo, or of the video's frames, px. 0 x 0 if that is not known before make_dataset. Throws InputError
/// for a video that cannot be read.
ImageSize smallest_image(const std::filesystem::path& input);

/// The path of the dataset whose images are in `folder`, and which has their cameras. Empty if there is no such dataset.
std::filesystem::path dataset_of_images(const std::filesystem::path& folder);

/// Throws InputError, which says what the path is, unless is_capture(path) is true or the path has a dataset's files. Also throws
/// for a folder of images whose cameras are in a dataset, and names that dataset.
void check_training_input(const std::filesystem::path& path);

/// Makes a dataset of a folder of photos, a video, a folder of videos, or a zip archive. Photos are JPEG, PNG, TIFF or BMP, and
/// HEIC or AVIF where a program converts them. Subfolders count. An archive is unpacked into unpacked/. If the archive holds a
/// dataset, `folder` gets that dataset, and COLMAP does not run.
/// - images: the frames of the videos, or a link to the photos' folder, or a folder with converted photos and the others beside them.
/// - masks: those that lie among the photos, or in masks/ beside their folder.
/// - sparse/0: COLMAP's model, made last. A lens has one radial term, or OpenCV's radial and tangential terms where many photos
///   share it and determine them. 360° photos get the lens of all directions.
///   With `level`, y of its world points down where the photos determine that. With GPS in the photos, x points east, z north, and
///   a unit is a metre.
/// - place.json: the place of the world's origin on the globe, where GPS says it.
/// - colmap/: files with which COLMAP continues, and log.txt with the output of the programs.
/// - capture.json: input, options, and hashes of the photos or the video. If they are the same, the folder is continued,
///   and finished steps are not repeated.
///
/// progress is called at least every tenth of a second; false ends the run. Throws InputError: no such input, a folder
/// of something else, too few photos, HEIC that no program converts, a video that ffmpeg cannot read. It also throws InputError if
/// photos or a video have changed since the search began, or if COLMAP finds no cameras. Throws RunError: ffmpeg or colmap is
/// missing or fails, disk.
Capture make_dataset(const std::filesystem::path& input, const std::filesystem::path& folder,
                     const CaptureOptions& options,
                     const std::function<bool(const CaptureProgress&)>& progress);

}  // namespace ewa
