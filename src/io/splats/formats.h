// SPDX-License-Identifier: Apache-2.0
// The readers and writers of the splat formats. Each source describes the layout of its format.
//
// Readers throw InputError that names the file and the byte or property. Writers write a temporary file and
// rename it, return a line for each thing that the format does not store, and throw RunError.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/splat_scene.h"
#include "io/splats/value_files.h"

namespace ewa::core {
class FileReader;
}

namespace ewa::io {

class PlyTable;

/// INRIA's PLY. Accepts any property order and scalar type, ascii and binary of either byte order. Other
/// properties and elements are ignored. Values stay as they are, finite or not. Positions in double far from
/// the world's origin become means relative to an origin of the scene. The marks of render_mark.h and the comment
/// "ewa kernel density", which sets Gaussians::density, are not among SplatScene::comments.
SplatScene read_ply(const std::filesystem::path& path);

/// Writes binary_little_endian and float32. If the scene has an origin, x y z are world positions in double.
/// The anti-aliased mark is Brush's.
std::vector<std::string> write_ply(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options);

/// The bytes that write_ply would write, in pieces: the header, then the rows of the splats.
std::string ply_header(const Gaussians& gaussians, const SaveOptions& options);
size_t ply_row_bytes(const Gaussians& gaussians);
/// Appends the row of splat i, ply_row_bytes() / 4 floats, to `rows`.
void append_ply_row(const Gaussians& gaussians, size_t i, std::vector<float>& rows);

/// SuperSplat's compressed PLY, with the marks of read_ply. is_compressed_ply: whether the header declares this layout.
bool is_compressed_ply(const PlyTable& table);
SplatScene read_compressed_ply(const std::filesystem::path& path);

/// Writes the splats in Morton order, which keeps the boxes of the chunks small. The highest SH degrees are not written where
/// all of their coefficients are 0.
std::vector<std::string> write_compressed_ply(const std::filesystem::path& path, const Gaussians& gaussians,
                                              const SaveOptions& options);

/// The format of antimatter15's viewer, without view dependence. The size must be a multiple of 32 bytes.
SplatScene read_splat(const std::filesystem::path& path);

/// Writes the splats in the order of the scene.
std::vector<std::string> write_splat(const std::filesystem::path& path, const Gaussians& gaussians,
                                     const SaveOptions& options);

/// The format of GaussianSplats3D (mkkellogg), version 0.1, compression levels 0 to 2. Sections may differ in SH
/// degree; missing coefficients are 0.
SplatScene read_ksplat(const std::filesystem::path& path);

/// SPZ (nianticlabs/spz), versions 1 to 4. SH degree 4 is cut to degree 3, and extension records are skipped.
SplatScene read_spz(const std::filesystem::path& path);
SplatScene read_spz(core::FileReader& reader);

/// Writes version 2, 3 or 4, as options.spz_version states. Positions have 12 fractional bits, or fewer if a
/// coordinate does not fit. Throws InputError for a coordinate beyond +-8388607 or more than 2^32 - 1 splats.
std::vector<std::string> write_spz(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options);

/// The loss of packing as SPZ.
struct SpzLoss {
    int version = 0, sh_degree = 0;
    int fractional_bits = 24;  // of positions
    uint64_t clamped = 0;      // values outside their range

    void add(const SpzLoss& other);
    std::vector<std::string> remarks() const;
};

/// The bytes that write_spz would write to `path`, which errors name. Adds to `loss`.
std::string pack_spz(const std::filesystem::path& path, const Gaussians& gaussians,
                     const SaveOptions& options, SpzLoss& loss);

/// glTF with KHR_gaussian_splatting. Reads every primitive with the extension that the scene's nodes reach,
/// in the order of the nodes, into one scene. Accepts float32 and the quantised component types, with or
/// without stride, in both colour spaces. Colours in linear light become sRGB values; their view dependence
/// is converted to first order. Buffers may be the .glb's own, data URIs, or files in or below the file's
/// folder. Refuses kernels other than "ellipse", sparse and compressed accessors. Errors name the byte, or
/// the mesh, node or accessor and its property.
SplatScene read_gltf_splats(const std::filesystem::path& path);

/// The files that hold the values of an existing .gltf. Empty if it holds them itself or cannot be read.
std::vector<std::filesystem::path> gltf_values(const std::filesystem::path& gltf);

/// The files that write_gltf_splats writes and removes beside a .gltf. The usual name of the values is STEM.bin.
ValueFiles gltf_value_files(const std::filesystem::path& gltf);

/// Writes float32 throughout and sRGB colours. The extension .glb makes one file, any other one a .gltf and the
/// file of gltf_value_files. Throws InputError for a scene without splats or more than 4 GiB in a .glb.
std::vector<std::string> write_gltf_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                           const SaveOptions& options);

/// SOG (PlayCanvas): read_sog reads a zip archive, read_sog_meta a meta.json with its images beside it. Versions
/// 1 and 2. The names in meta.json must stay in the archive or the folder. Errors name the file and the image
/// or the property of meta.json. render_mark.h has the marks.
SplatScene read_sog(const std::filesystem::path& path);
SplatScene read_sog_meta(const std::filesystem::path& path);

/// Whether the file is the meta.json of a SOG, whatever its name.
bool is_sog_meta(const std::filesystem::path& path);

/// Writes version 2 in Morton order: lossless images in an archive of stored entries. The same scene gives the
/// same bytes with the same libwebp. SH of degree 1 and more become a palette of at most 65,536 rows, see
/// make_palette. Throws InputError for more splats than a WebP image has pixels.
std::vector<std::string> write_sog(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options);

/// The bytes that write_sog would write to `path`, which errors name.
std::string pack_sog(const std::filesystem::path& path, const Gaussians& gaussians,
                     const SaveOptions& options, std::vector<std::string>& remarks);

/// The same as a meta.json with the images of sog_value_files beside it.
std::vector<std::string> write_sog_meta(const std::filesystem::path& path, const Gaussians& gaussians,
                                        const SaveOptions& options);

/// The same with the splats in the order of the scene, not in Morton order.
std::vector<std::string> write_sog_rows(const std::filesystem::path& path, const Gaussians& gaussians,
                                        const SaveOptions& options);

/// The images that an existing meta.json names. Empty if it cannot be read.
std::vector<std::filesystem::path> sog_images(const std::filesystem::path& meta);

/// The files that write_sog_meta writes and removes beside a meta.json. The usual names are means_l.webp and so on.
ValueFiles sog_value_files(const std::filesystem::path& meta);

/// Streamed SOG, a lod-meta.json. read_levels reads level 0. Splats come in the order of the chunks and their rows. Errors name the
/// file and the property. The names in it must stay in its folder. The environment is skipped with a remark.
SplatScene read_level(const std::filesystem::path& path, size_t level);
SplatScene read_levels(const std::filesystem::path& path);
std::vector<size_t> count_levels(const std::filesystem::path& path);

/// Writes the chunks, one level after the other, then the lod-meta.json. Throws InputError for a scene without splats. The same
/// scene gives the same bytes.
std::vector<std::string> write_levels(const std::filesystem::path& path, Gaussians gaussians,
                                      const SaveOptions& options);

/// The files that an existing lod-meta.json names, with the images that those name. Empty if it cannot be read.
std::vector<std::filesystem::path> level_files(const std::filesystem::path& path);

/// OpenUSD's ParticleField3DGaussianSplat, as text and as a package of it: float32 throughout, with y up. Throw InputError for a
/// .usdz of more than 4 GiB. It is in memory as a whole.
std::vector<std::string> write_usda(const std::filesystem::path& path, const Gaussians& gaussians,
                                    const SaveOptions& options);
std::vector<std::string> write_usdz(const std::filesystem::path& path, const Gaussians& gaussians,
                                    const SaveOptions& options);

/// An HTML file that shows the scene in a browser, with options.page (scene_page.h), and its levels if it is unbundled. Splats must be
/// drawable.
std::vector<std::string> write_page(const std::filesystem::path& path, Gaussians gaussians,
                                    const SaveOptions& options);

}  // namespace ewa::io
