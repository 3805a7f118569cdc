// SPDX-License-Identifier: Apache-2.0
// Any bytes through one reader: a scene whose arrays fit each other, or an InputError of one line that names
// a byte or a property, within the memory and the time (a second, under the sanitizers) allowed.
#include EWA_HEADER

#include <zlib.h>

#include <cctype>
#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "ewa/error.h"
#include "ewa/gaussians.h"
#include "ewa/splat_edit.h"
#include "input.h"
#include "io/splats/formats.h"
#include "io/splats/tileset.h"
#include "scene/decimate.h"

namespace {

using namespace ewa;

/// What would be found in a gzip stream is mutated unpacked: mutations of packed bytes only find its
/// checksum.
[[maybe_unused]] std::string packed(const uint8_t* data, size_t size) {
    z_stream stream{};
    if (deflateInit2(&stream, 1, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK) std::abort();
    std::string out(deflateBound(&stream, uLong(size)) + 32, '\0');
    stream.next_in = const_cast<Bytef*>(data);
    stream.avail_in = uInt(size);
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = uInt(out.size());
    if (deflate(&stream, Z_FINISH) != Z_STREAM_END) std::abort();
    out.resize(out.size() - stream.avail_out);
    deflateEnd(&stream);
    return out;
}

#ifdef EWA_SUM_ARCHIVE
/// The same for a zip archive's stored entries, as far as its directory leads to them.
std::string with_entry_checksums(const uint8_t* data, size_t size) {
    constexpr size_t kLocalHeader = 30, kDirectoryHeader = 46;
    std::string bytes(reinterpret_cast<const char*>(data), size);
    const auto word = [&](size_t at, size_t length) {
        uint32_t value = 0;
        std::memcpy(&value, &bytes[at], length);
        return size_t(value);
    };
    for (size_t at = bytes.find("PK\1\2"); at != std::string::npos && at + kDirectoryHeader <= size;
         at = bytes.find("PK\1\2", at + 4)) {
        const size_t local = word(at + 42, 4), length = word(at + 20, 4);
        if (word(at + 10, 2) != 0 || local > size || size - local < kLocalHeader) continue;
        const size_t begin = local + kLocalHeader + word(local + 26, 2) + word(local + 28, 2);
        if (begin > size || length > size - begin) continue;
        const auto sum = uint32_t(crc32_z(0, reinterpret_cast<const Bytef*>(&bytes[begin]), length));
        std::memcpy(&bytes[at + 16], &sum, sizeof(sum));
        std::memcpy(&bytes[local + 14], &sum, sizeof(sum));
    }
    return bytes;
}
#endif

#ifdef EWA_SUM_CHECKPOINT
/// The same for a checkpoint's sections: each with its checksum.
std::string with_checksums(const uint8_t* data, size_t size) {
    constexpr size_t kHeader = 16, kSum = 24, kSection = 32;
    std::string bytes(reinterpret_cast<const char*>(data), size);
    for (size_t at = kHeader; at + kSection <= size;) {
        uint64_t length = 0;
        std::memcpy(&length, &bytes[at + 16], sizeof(length));
        if (length > size - at - kSection) break;
        const auto* section = reinterpret_cast<const Bytef*>(&bytes[at]);
        const auto sum = uint32_t(crc32_z(crc32_z(0, section, kSum), section + kSection, length));
        std::memcpy(&bytes[at + kSum], &sum, sizeof(sum));
        at += kSection + length;
    }
    return bytes;
}

void check_scene(const train::Checkpoint& checkpoint) {
    const std::string text = std::to_string(checkpoint.state.arrays.size()) + " arrays";
    EWA_REQUIRE(checkpoint.state.sh_degree >= 0 && checkpoint.state.sh_degree <= kMaxShDegree);
    EWA_REQUIRE(checkpoint.state.report.step >= 0);
}
#elif defined(EWA_READ_POINTS)
void check_scene(const io::PlyPoints& read) {
    const std::string text = std::to_string(read.points.positions.size()) + " points";
    EWA_REQUIRE(read.points.positions.size() == read.points.colors.size());
    for (const glm::dvec3& p : read.points.positions)
        EWA_REQUIRE(std::isfinite(float(p.x)) && std::isfinite(float(p.y)) && std::isfinite(float(p.z)));
}
#elif defined(EWA_READ_ZIP)
void check_scene(uint64_t bytes) {
    const std::string text = std::to_string(bytes) + " bytes";
    EWA_REQUIRE(bytes < uint64_t(1) << 40);
}
#elif defined(EWA_READ_VIEWS)
void check_scene(const std::vector<io::NamedView>& views) {
    const std::string text = std::to_string(views.size()) + " views";
    EWA_REQUIRE(views.size() <= io::kMostViews);
    for (const io::NamedView& view : views)
        EWA_REQUIRE(view.camera.width > 0 && view.camera.height > 0 && view.camera.fx > 0 &&
                    view.camera.fy > 0);
}
#elif defined(EWA_READ_APPEARANCES)
void check_scene(const std::map<std::string, Appearance>& appearances) {
    for (const auto& [name, appearance] : appearances) {
        const std::string& text = name;
        const auto finite = [&](const auto& values) {
            for (const float value : values) EWA_REQUIRE(std::isfinite(value));
        };
        if (const auto* ppisp = std::get_if<Ppisp>(&appearance)) {
            finite(ppisp->photo);
            finite(ppisp->camera);
        } else if (const auto* grid = std::get_if<ColorGrid>(&appearance)) {
            EWA_REQUIRE(grid->cells.size() == 24576);
            finite(grid->cells);
        } else {
            finite(std::get<Exposure>(appearance));
        }
    }
}
#elif defined(EWA_READ_SKY)
void check_scene(const SkyMap& sky) {
    const std::string text = "a sky of " + std::to_string(sky.size);
    EWA_REQUIRE(sky.size >= 1 && sky.size <= kMostSkyTexels);
    EWA_REQUIRE(sky.texels.size() == size_t(3) * size_t(sky.size) * size_t(sky.size));
    for (const float value : sky.texels) EWA_REQUIRE(std::isfinite(value));
}
#elif defined(EWA_READ_TIMES)
void check_scene(const train::RunTimes& times) {
    const std::string text = std::to_string(times.metrics.size()) + " times";
    for (const auto* all : {&times.metrics, &times.checkpoints})
        for (const train::TimesAt& time : *all)
            EWA_REQUIRE(time.step >= 0 && time.seconds >= 0 && std::isfinite(time.seconds) &&
                        time.wall_seconds >= 0 && std::isfinite(time.wall_seconds));
}
#elif defined(EWA_READ_MESH)
void check_scene(const scene::MeshScene& scene) {
    const std::string text = std::to_string(scene.triangles.size()) + " triangles";
    EWA_REQUIRE(!scene.triangles.empty() && !scene.materials.empty());
    for (const scene::Triangle& t : scene.triangles) {
        EWA_REQUIRE(t.material < scene.materials.size());
        for (size_t k = 0; k < 3; ++k) {
            EWA_REQUIRE(std::isfinite(float(t.corners[k].x)) && std::isfinite(float(t.corners[k].y)) &&
                        std::isfinite(float(t.corners[k].z)));
            EWA_REQUIRE(std::isfinite(t.uvs[k].x) && std::isfinite(t.uvs[k].y));
        }
    }
    const auto within = [](int index, size_t size) { return index >= -1 && index < static_cast<int>(size); };
    for (const scene::Material& m : scene.materials) {
        EWA_REQUIRE(within(m.base_texture, scene.textures.size()) &&
                    within(m.metal_texture, scene.textures.size()));
        EWA_REQUIRE(within(m.emitted_texture, scene.textures.size()));
        EWA_REQUIRE(m.opacity >= 0 && m.opacity <= 1 && m.emitted.x >= 0 && m.emitted.x < 1e30f);
    }
    for (const scene::Texture& t : scene.textures)
        EWA_REQUIRE(t.image >= 0 && within(t.image, scene.images.size()));
    for (const scene::Light& light : scene.lights)
        EWA_REQUIRE(std::isfinite(light.direction.x) && light.intensity.x >= 0 && light.range >= 0);
}
#else
/// What commands do with a scene: fewer splats in both ways, and levels of it.
void use_scene(const Gaussians& gaussians, bool write) {
    constexpr size_t kMost = 2000;
    Gaussians whole = gaussians;
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < whole.size(); ++i)
        if (drawable(whole, i)) kept.push_back(uint32_t(i));
    if (kept.empty() || kept.size() > kMost) return;
    keep_splats(whole, kept);
    const std::string text = std::to_string(whole.size()) + " splats";
    for (const size_t target : {(whole.size() + 1) / 2, size_t(1)}) {
        Gaussians fewer = gaussians, traced = whole;
        decimate_splats(fewer, target);
        EWA_REQUIRE(fewer.size() == std::min(target, whole.size()));
        std::vector<float> errors;
        scene::decimate_traced(traced, target, errors);
        EWA_REQUIRE(traced.size() == target && errors.size() == target);
    }
    if (!write) return;
    static const std::filesystem::path folder = fuzz::make_folder();
    for (const char* name : {"lod-meta.json", "tileset.json"}) try {
            const SaveOptions options{.levels = 2};
            if (std::string_view(name) == "lod-meta.json")
                io::write_levels(folder / name, whole, options);
            else
                io::write_tileset(folder / name, whole, options);
        } catch (const InputError&) {  // values that a format has no room for
        }
}

void check_scene(const SplatScene& scene) {
    const Gaussians& g = scene.gaussians;
    const size_t n = g.size();
    const std::string text = std::to_string(n) + " splats";
    EWA_REQUIRE(g.sh_degree >= 0 && g.sh_degree <= kMaxShDegree);
    EWA_REQUIRE(g.means.size() == 3 * n && g.quaternions.size() == 4 * n && g.log_scales.size() == 3 * n);
    EWA_REQUIRE(g.sh.size() == g.sh_stride() * n);
    use_scene(g, n % 8 == 0);
}
#endif

/// "byte 12", or what a glTF or a PLY calls the place.
void check_error(const std::string& text) {
    bool named = false;
    for (size_t at = text.find("byte "); at != std::string::npos; at = text.find("byte ", at + 1))
        named = named || std::isdigit(static_cast<unsigned char>(text[at + 5]));
    for (const char* place :
         {"\"",    "'",       "`",       "properties f_rest_", "attribute ", "accessor",  "node ",
          "mesh ", "buffer ", "image ",  "material ",          "texture ",   "the JSON ", "claims ",
          "view ", "line ",   "begins ", "is empty",           "it is a",    "is UTF-16"})
        named = named || text.find(place) != std::string::npos;
    EWA_REQUIRE(named);
    EWA_REQUIRE(text.find('\n') == std::string::npos && text.size() < 2000);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static fuzz::MemoryFile file;
    std::string bytes;
#ifdef EWA_PACK_SPZ
    if (size > 8 && std::memcmp(data, "NGSP", 4) == 0 && data[4] < 4) bytes = packed(data, size);
#endif
#ifdef EWA_SUM_CHECKPOINT
    bytes = with_checksums(data, size);
#endif
#ifdef EWA_SUM_ARCHIVE
    bytes = with_entry_checksums(data, size);
#endif
    if (!bytes.empty()) {
        data = reinterpret_cast<const uint8_t*>(bytes.data());
        size = bytes.size();
    }
    const std::string& path = file.hold(data, size);
    fuzz::read_within(size, 1, [&] {
        try {
            check_scene(EWA_READ(path));
        } catch (const InputError& error) {
            check_error(error.what());
        }
    });
    return 0;
}
