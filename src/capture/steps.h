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

/// Calls work(i) for each i < now.total - now.done on all cores, and says how many are done. most: of them at once. Throws Stopped,
/// and what work throws.
void on_all_cores(CaptureProgress now, const ProgressFunction& progress,
                  const std::function<void(size_t)>& work, size_t most = SIZE_MAX);

/// The variance of a grey image's Laplacian (Pech-Pacheco et al. 2000): larger where the image is sharper. Images of
/// one size can be compared. 0 for an image of less than 3 x 3 pixels.
double sharpness(const std::uint8_t* pixels, int width, int height);

/// The index of the sharpest image in each of `parts` parts of equal length, in order; all of them if there are fewer.
std::vector<int> sharpest(const std::vector<double>& sharpness, int parts);

/// Takes the images out of a stream of binary PGM or PPM files that arrives in pieces of any size.
class PgmStream {
  public:
    struct Kind {
        std::string_view magic;
        uint64_t largest, pixel_bytes, most_pixels;
    };
    static constexpr Kind kGrey{"P5", 255, 1, uint64_t(1) << 24};
    static constexpr Kind kDeepColour{"P6", 65535, 6, uint64_t(1) << 27};

    explicit PgmStream(std::function<void(const std::uint8_t* pixels, int width, int height)> image,
                       const Kind& kind = kGrey)
        : image_(std::move(image)), kind_(kind) {}
    /// Throws RunError where the stream is not of this kind.
    void add(std::string_view bytes);

  private:
    bool take_one();

    std::function<void(const std::uint8_t*, int, int)> image_;
    Kind kind_;
    std::string rest_;
};

/// Throws RunError with the package to install if the program is missing.
void require_ffmpeg();
void require_colmap();

/// Arguments with which ffmpeg and ffprobe read a video. A name that begins with a dash, or has a colon, is a file all the same.
/// A playlist would lead to other files, and is refused whatever its name.
std::vector<std::string> film_input(const std::filesystem::path& video);

/// Writes the sharpest frames of videos to `images` as JPEG files of sRGB. Those of several videos go into folders with their names.
/// Programs write to the log. Returns remarks. Throws InputError if ffmpeg can read no video, RunError, Stopped.
std::vector<std::string> extract_frames(const std::vector<std::filesystem::path>& videos,
                                        const std::filesystem::path& images, int frames,
                                        const std::filesystem::path& log, const ProgressFunction& progress);

constexpr size_t kLeastPhotos = 3;
constexpr size_t kNamed = 8;  // photos that a line names

/// The size of the frames. 0 x 0 where it is not known. Throws as film_info.
ImageSize video_size(const std::filesystem::path& video);

/// The images of a folder, relative to it and sorted. Folders below it that ewa has made are skipped.
struct Pictures {
    std::vector<std::filesystem::path> photos;
    std::vector<std::filesystem::path> others;  // masks, depth maps and their like, by their names
};
Pictures pictures_in(const std::filesystem::path& folder);
/// The photos alone.
std::vector<std::filesystem::path> photo_files(const std::filesystem::path& folder);
/// The same. Throws InputError if one is HEIC that nothing here converts, or a link out of the folder.
std::vector<std::filesystem::path> photos_in(const std::filesystem::path& folder);

/// Whether the extension is a film's.
bool is_film(const std::filesystem::path& file);
/// The films of a folder and the folders below it, relative to it and sorted.
std::vector<std::filesystem::path> films_in(const std::filesystem::path& folder);
/// Removes small copies, which cameras and editors write beside films, if there are other films. Returns the copies.
std::vector<std::filesystem::path> take_proxies(std::vector<std::filesystem::path>& films);

/// Whether the photo is of HEIF's family (HEIC, AVIF), which COLMAP does not read.
bool is_heif(const std::filesystem::path& file);
/// Whether a program is here that converts such photos.
bool converts_heif();
/// The name that a photo has for COLMAP.
std::filesystem::path converted_name(const std::filesystem::path& name);
/// Makes a folder of the photos by those names: HEIF as JPEG, and links to the others' files, or copies. A photo that cannot be
/// converted is skipped. Throws RunError, Stopped.
void convert_photos(const std::filesystem::path& photos, const std::vector<std::filesystem::path>& names,
                    const std::filesystem::path& folder, const std::filesystem::path& log,
                    const ProgressFunction& progress);

struct FoundMasks {
    std::vector<std::filesystem::path> files;  // of each photo; empty if it has none
    std::string text;                          // a line for the user; empty if there are no masks
};
/// The masks of photos with these names, by the rules for datasets. project: the path that the user named. Throws InputError.
FoundMasks find_masks(const std::filesystem::path& photos, const std::vector<std::filesystem::path>& names,
                      const std::filesystem::path& project);
/// Copies the masks into a folder as COLMAP wants them: NAME.png for a photo NAME, of its size. images: the folder with the photos
/// under their names. Newer copies stay. Returns FoundMasks::text. Throws InputError, RunError, Stopped.
std::string copy_masks(const std::filesystem::path& photos, const std::vector<std::filesystem::path>& names,
                       const std::filesystem::path& images, const std::filesystem::path& masks,
                       const std::filesystem::path& project, const ProgressFunction& progress);

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

/// A line for a file: a hash of its content, a space, and its name. The record is JSON, which is UTF-8.
std::string line_of(const std::filesystem::path& folder, const std::filesystem::path& name);

/// The photos of a search for cameras, after those that changed since it began were removed.
struct Chosen {
    std::vector<std::filesystem::path> names;  // that COLMAP gets
    std::set<std::string> gone;  // names of photos whose pictures changed: their views do not count
    std::vector<std::string> remarks;
};

/// Checks all photos before a search. Those that cannot be used are noted in the record. Throws InputError if too few can be used,
/// Stopped.
Chosen first_choice(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& found,
                    Json& record, const ProgressFunction& progress);

/// Skips photos that have changed since a search began. before: its record.
Chosen later_choice(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& found,
                    const Json& before);

/// Photos whose cameras COLMAP describes alike.
struct LensGroup {
    std::vector<std::filesystem::path> photos;  // sorted
    bool shared = true;                         // one camera; else one for each photo
};

/// Photos of one size, camera and focal length share a camera. Throws InputError where a photo cannot be read.
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

/// The photos or views that COLMAP has to place.
struct Photos {
    std::filesystem::path folder;              // of the images
    std::vector<std::filesystem::path> names;  // relative to it
    Pairing pairing = Pairing::all;
    std::filesystem::path masks = {};  // NAME.png of each name; empty: none
    bool level = true;                 // as CaptureOptions::level
};

/// The lines for the user about the cameras that were found.
struct Found {
    std::vector<std::string> remarks;
    std::string axes;  // as Capture::axes
};

/// Runs COLMAP in `work` and leaves its largest model in `model` (cameras.bin, images.bin, points3D.bin). Throws
/// InputError if nothing can be placed, RunError, Stopped. COLMAP gets views of 360° photos, and the model is that of the photos.
/// place: the file that gets the place of the model's origin, if it is known.
Found place_photos(const Photos& photos, const std::filesystem::path& work,
                   const std::filesystem::path& model, const std::filesystem::path& place,
                   const ProgressFunction& progress);

}  // namespace ewa::capture
