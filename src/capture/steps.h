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

/// Calls work(i) for each i < now.total - now.done on all cores, and reports how many are done. most: calls at one time. Throws
/// Stopped, and exceptions of work.
void on_all_cores(CaptureProgress now, const ProgressFunction& progress,
                  const std::function<void(size_t)>& work, size_t most = SIZE_MAX);

/// The variance of a grey image's Laplacian (Pech-Pacheco et al. 2000): larger where the image is sharper. Images of
/// one size can be compared. 0 for an image of less than 3 x 3 pixels.
double sharpness(const std::uint8_t* pixels, int width, int height);

/// Divides the images into `parts` parts of equal length. Returns the index of the sharpest image of each part, in order, or all
/// indices if there are fewer images than parts.
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
    /// Adds the stream's next bytes, and calls `image` for each complete image. Throws RunError if the stream is not of this kind.
    void add(std::string_view bytes);

  private:
    bool take_one();

    std::function<void(const std::uint8_t*, int, int)> image_;
    Kind kind_;
    std::string rest_;
};

/// Throws RunError with the package to install if the program is missing.
void require_ffmpeg();

/// Arguments with which ffmpeg and ffprobe read a video. They read a name that begins with a dash, or has a colon, as a file too.
/// They refuse playlists, whatever the name, because a playlist would make them read other files.
std::vector<std::string> film_input(const std::filesystem::path& video);

/// Writes the sharpest frames of videos to `images` as JPEG files of sRGB. With several videos, each has a subfolder of its name.
/// log: the file for the programs' output. Returns remarks. Throws InputError if ffmpeg can read no video, RunError, Stopped.
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
/// The photos of pictures_in(), without masks and other images.
std::vector<std::filesystem::path> photo_files(const std::filesystem::path& folder);
/// As photo_files(). Throws InputError for a HEIC photo that no installed program converts, and for a link out of the folder.
std::vector<std::filesystem::path> photos_in(const std::filesystem::path& folder);

/// Whether the extension is a film's.
bool is_film(const std::filesystem::path& file);
/// The films of a folder and the folders below it, relative to it and sorted.
std::vector<std::filesystem::path> films_in(const std::filesystem::path& folder);
/// Removes proxies from `films`: small copies that cameras and editors write beside films. Keeps them if there are no other films.
/// Returns the proxies.
std::vector<std::filesystem::path> take_proxies(std::vector<std::filesystem::path>& films);

/// Whether the photo is of HEIF's family (HEIC, AVIF), which COLMAP does not read.
bool is_heif(const std::filesystem::path& file);
/// Whether this machine has a program that converts HEIF photos.
bool converts_heif();
/// The name under which COLMAP gets a photo: that of a HEIF photo ends in .jpg.
std::filesystem::path converted_name(const std::filesystem::path& name);
/// Makes a folder with the photos under their converted_name(). HEIF photos become JPEG; others are links or copies. Skips a photo
/// that cannot be converted. Throws RunError, Stopped.
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
/// Writes the masks into a folder in COLMAP's form: NAME.png for a photo NAME, in the photo's size. images: the folder of COLMAP's
/// photos. Keeps copies that are newer than their masks. Returns FoundMasks::text. Throws InputError, RunError, Stopped.
std::string copy_masks(const std::filesystem::path& photos, const std::vector<std::filesystem::path>& names,
                       const std::filesystem::path& images, const std::filesystem::path& masks,
                       const std::filesystem::path& project, const ProgressFunction& progress);

/// A photo that COLMAP does not get.
struct Skipped {
    std::filesystem::path name;
    std::string reason;
};

/// The photos that cannot be decoded, and why. Decodes all photos, on all cores. Throws Stopped.
std::vector<Skipped> faults_in(const std::filesystem::path& folder,
                               const std::vector<std::filesystem::path>& names,
                               const ProgressFunction& progress);

/// A line for the user about skipped photos, with the first of their names.
std::string skipped_text(const std::vector<Skipped>& skipped);
/// The first names, separated by commas.
std::string names_text(const std::vector<std::string>& names);

/// Throws InputError if `count` photos are too few.
void require_photos(const std::filesystem::path& folder, size_t count, const std::vector<Skipped>& skipped);

using Json = nlohmann::ordered_json;  // of capture.json

/// The line that identifies a file in capture.json: a hash of its content, a space, and its name in UTF-8.
std::string line_of(const std::filesystem::path& folder, const std::filesystem::path& name);

/// The photos of a search for cameras, after those that changed since it began were removed.
struct Chosen {
    std::vector<std::filesystem::path> names;  // that COLMAP gets
    std::set<std::string> gone;  // names of photos whose pictures changed: their views do not count
    std::vector<std::string> remarks;
};

/// Checks all photos before a search. Writes to the record which photos cannot be used. Throws InputError if too few can be used,
/// Stopped.
Chosen first_choice(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& found,
                    Json& record, const ProgressFunction& progress);

/// Chooses photos for a search that continues. Skips those that changed since it began. before: the record of the search.
Chosen later_choice(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& found,
                    const Json& before);

/// Photos whose cameras COLMAP describes alike.
struct LensGroup {
    std::vector<std::filesystem::path> photos;  // sorted
    bool shared = true;                         // the photos share one camera; else each has its own
};

/// Groups the photos that share a lens: those of one size, camera model and focal length. Throws InputError if one cannot be read.
std::vector<LensGroup> lenses_of(const std::filesystem::path& folder,
                                 const std::vector<std::filesystem::path>& names);

/// Removes the views of these images from a COLMAP model (.bin), also from the points' tracks. Throws InputError where the
/// model cannot be read, RunError.
void remove_views(const std::filesystem::path& model, const std::set<std::string>& names);

/// Which pairs of photos are compared.
enum class Pairing {
    by_look,      // those that share prominent features, and neighbours in the order of names
    in_sequence,  // neighbours in the order of names, and some later ones
    all
};

/// The photos, or views of panoramas, whose cameras COLMAP has to find.
struct Photos {
    std::filesystem::path folder;              // of the images
    std::vector<std::filesystem::path> names;  // relative to it
    Pairing pairing = Pairing::all;
    std::filesystem::path masks = {};   // NAME.png of each name; empty: none
    bool level = true;                  // as CaptureOptions::level
    std::filesystem::path python = {};  // as CaptureOptions::python
};

/// The lines for the user about the cameras that were found.
struct Found {
    std::vector<std::string> remarks;
    std::string axes;  // as Capture::axes
};

/// Runs COLMAP in `work`, and writes its largest model to `model` (cameras.bin, images.bin, points3D.bin). Instead of 360°
/// photos COLMAP gets pinhole views of them, but the model has the photos. place: the file for the place of the model's
/// origin on the globe, if it is known. Throws InputError if no camera is found, RunError, Stopped.
Found place_photos(const Photos& photos, const std::filesystem::path& work,
                   const std::filesystem::path& model, const std::filesystem::path& place,
                   const ProgressFunction& progress);

}  // namespace ewa::capture
