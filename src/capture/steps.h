// SPDX-License-Identifier: Apache-2.0
// The steps from photos or a video to a dataset. Each writes its result under another name and renames it last, so that
// an interrupted step is done again and a finished one is kept.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/capture.h"

namespace ewa::capture {

using ProgressFunction = std::function<bool(const CaptureProgress&)>;

/// Thrown when the caller's progress function has ended the run.
struct Stopped {};

/// Calls work(i) for each i < now.total on all cores, and says how many are done. most: of them at once. Throws Stopped, and what
/// work throws.
void on_all_cores(CaptureProgress now, const ProgressFunction& progress,
                  const std::function<void(size_t)>& work, size_t most = SIZE_MAX);

/// The variance of a grey image's Laplacian (Pech-Pacheco et al. 2000): larger where the image is sharper. Images of
/// one size can be compared. 0 for an image of less than 3 x 3 pixels.
double sharpness(const std::uint8_t* pixels, int width, int height);

/// The index of the sharpest image in each of `parts` parts of equal length, in order; all of them if there are fewer.
std::vector<int> sharpest(const std::vector<double>& sharpness, int parts);

/// Takes the images out of a stream of binary PGM files that arrives in pieces of any size.
class PgmStream {
  public:
    explicit PgmStream(std::function<void(const std::uint8_t* pixels, int width, int height)> image)
        : image_(std::move(image)) {}
    /// Throws RunError where the stream is not PGM of 8 bits with at most 16 million pixels.
    void add(std::string_view bytes);

  private:
    bool take_one();

    std::function<void(const std::uint8_t*, int, int)> image_;
    std::string rest_;
};

/// Throws RunError with the package to install if the program is missing.
void require_ffmpeg();
void require_colmap();

/// Writes the sharpest frames of a video to `images` as JPEG files. Programs write to the log. Throws
/// InputError if ffmpeg cannot read the video, RunError, Stopped.
void extract_frames(const std::filesystem::path& video, const std::filesystem::path& images, int frames,
                    const std::filesystem::path& log, const ProgressFunction& progress);

constexpr size_t kLeastPhotos = 3;
constexpr size_t kNamed = 8;  // photos that a line names

/// The size of the frames. 0 x 0 where ffprobe does not say it.
ImageSize video_size(const std::filesystem::path& video);

/// The files of a folder that may be photos, relative to it and sorted. Folders below it that ewa has made do not count.
std::vector<std::filesystem::path> photo_files(const std::filesystem::path& folder);
/// The same. Throws InputError if one is HEIC, or a link out of the folder.
std::vector<std::filesystem::path> photos_in(const std::filesystem::path& folder);

/// A photo that COLMAP does not get.
struct Skipped {
    std::filesystem::path name;
    std::string reason;
};

/// Decodes all photos, on all cores. Throws Stopped.
std::vector<Skipped> faults_in(const std::filesystem::path& folder,
                               const std::vector<std::filesystem::path>& names,
                               const ProgressFunction& progress);

/// A line for the user, with the first names.
std::string skipped_text(const std::vector<Skipped>& skipped);
/// The first names, separated by commas.
std::string names_text(const std::vector<std::string>& names);

/// Throws InputError if `count` photos are too few.
void require_photos(const std::filesystem::path& folder, size_t count, const std::vector<Skipped>& skipped);

using Json = nlohmann::ordered_json;  // of capture.json

/// A line for a file: what distinguishes its content, a space, and its name. The record is JSON, which is UTF-8.
std::string line_of(const std::filesystem::path& folder, const std::filesystem::path& name);

/// What became of the photos since a search for their cameras began, or what begins it.
struct Chosen {
    std::vector<std::filesystem::path> names;  // that COLMAP gets
    std::set<std::string> gone;  // names of photos whose pictures changed: their views do not count
    std::vector<std::string> remarks;
};

/// Looks at all photos that were found, before a search. Those that cannot be used are noted in the record. Throws InputError
/// if too few are left, Stopped.
Chosen first_choice(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& found,
                    Json& record, const ProgressFunction& progress);

/// Skips what has changed since a search began. before: its record.
Chosen later_choice(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& found,
                    const Json& before);

/// Photos whose cameras COLMAP describes alike.
struct LensGroup {
    std::vector<std::filesystem::path> photos;  // sorted
    bool shared = true;                         // one camera; else one for each photo
    bool tangential = true;                     // two radial and two tangential terms; else one radial term
};

/// Photos of one size, camera and focal length share a camera. Tangential terms need ten photos, or all that there are.
/// Throws InputError where a photo cannot be read.
std::vector<LensGroup> lenses_of(const std::filesystem::path& folder,
                                 const std::vector<std::filesystem::path>& names);

/// Removes the views of these images from a COLMAP model (.bin), also from the points' tracks. Throws InputError where the
/// model cannot be read, RunError.
void remove_views(const std::filesystem::path& model, const std::set<std::string>& names);

/// Which photos are compared.
enum class Pairing {
    by_look,      // those that share prominent features, and neighbours in the order of names
    in_sequence,  // neighbours in the order of names, and some later ones
    all
};

/// What COLMAP has to place.
struct Photos {
    std::filesystem::path folder;              // of the images
    std::vector<std::filesystem::path> names;  // relative to it
    Pairing pairing = Pairing::all;
};

/// Runs COLMAP in `work` and leaves its largest model in `model` (cameras.bin, images.bin, points3D.bin). Throws
/// InputError if nothing can be placed, RunError, Stopped. Returns remarks. COLMAP gets views of
/// 360° photos, and the model is that of the photos.
std::vector<std::string> place_photos(const Photos& photos, const std::filesystem::path& work,
                                      const std::filesystem::path& model, const ProgressFunction& progress);

}  // namespace ewa::capture
