// SPDX-License-Identifier: Apache-2.0
// glTF with KHR_gaussian_splatting: what nodes, quantised values, colour spaces and damage come to.
#include <cmath>
#include <cstring>
#include <ctime>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>

#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "scene/splat_arrays.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using nlohmann::json;
using test::expect_error;
using test::Largest;
using test::largest_differences;
using test::storable_splats;
using test::TempFolder;

const std::string kPrefix = "KHR_gaussian_splatting:";

/// A .gltf and its buffer, to be changed and read.
class GltfFile {
  public:
    explicit GltfFile(const Gaussians& g) {
        save_splats(folder_ / "a.gltf", g);
        top = json::parse(test::file_bytes(folder_ / "a.gltf"));
        buffer = test::file_bytes(folder_ / "a.bin");
    }
    json& primitive() { return top["meshes"][0]["primitives"][0]; }
    json& extension() { return primitive()["extensions"]["KHR_gaussian_splatting"]; }
    int index(const std::string& name) { return primitive()["attributes"][name]; }
    json& accessor(const std::string& name) { return top["accessors"][index(name)]; }

    /// Replaces an attribute's values by others of another type, at the buffer's end.
    void replace(const std::string& name, int component, bool normalized, const std::string& bytes,
                 int stride = 0) {
        while (buffer.size() % 4 != 0) buffer += '\0';
        json view = {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}};
        if (stride > 0) view["byteStride"] = stride;
        accessor(name)["bufferView"] = top["bufferViews"].size();
        accessor(name)["componentType"] = component;
        accessor(name)["normalized"] = normalized;
        top["bufferViews"].push_back(view);
        buffer += bytes;
        top["buffers"][0]["byteLength"] = buffer.size();
    }
    SplatScene read() {
        folder_.write("a.bin", buffer);
        return read_splats(folder_.write("a.gltf", top.dump()));
    }
    void refused(std::initializer_list<std::string> parts) {
        expect_error<InputError>([&] { read(); }, parts);
    }
    const TempFolder& folder() const { return folder_; }

    json top;
    std::string buffer;

  private:
    TempFolder folder_;
};

TEST(GltfSplats, SaysWhatTheExtensionAsks) {
    GltfFile gltf(storable_splats(1, 30, 3));
    EXPECT_EQ(gltf.top["extensionsUsed"], json::array({"KHR_gaussian_splatting"}));
    EXPECT_EQ(gltf.primitive()["mode"], 0);
    EXPECT_EQ(gltf.extension()["kernel"], "ellipse");
    EXPECT_EQ(gltf.extension()["colorSpace"], "srgb_rec709_display");
    const std::map<std::string, std::string> types = {{"POSITION", "VEC3"},
                                                      {"COLOR_0", "VEC4"},
                                                      {kPrefix + "ROTATION", "VEC4"},
                                                      {kPrefix + "SCALE", "VEC3"},
                                                      {kPrefix + "OPACITY", "SCALAR"},
                                                      {kPrefix + "SH_DEGREE_0_COEF_0", "VEC3"},
                                                      {kPrefix + "SH_DEGREE_3_COEF_6", "VEC3"}};
    for (const auto& [name, type] : types) {
        EXPECT_EQ(gltf.accessor(name)["type"], type) << name;
        EXPECT_EQ(gltf.accessor(name)["count"], 30) << name;
    }
    EXPECT_EQ(gltf.primitive()["attributes"].size(), 5u + 16u);
    EXPECT_EQ(gltf.accessor("POSITION")["min"].size(), 3u);
}

TEST(GltfSplats, FallbackColourIsInLinearLight) {
    Gaussians g = storable_splats(1, 1, 0);
    g.sh = {0, 100, -100};  // 0.5, above 1, below 0
    g.opacity_logits = {0};
    GltfFile gltf(g);
    const size_t at =
        gltf.top["bufferViews"][gltf.accessor("COLOR_0")["bufferView"].get<size_t>()]["byteOffset"];
    uint16_t color[4];
    std::memcpy(color, gltf.buffer.data() + at, sizeof(color));
    EXPECT_NEAR(color[0] / 65535.0, 0.21404, 1e-4);  // 0.5 of sRGB
    EXPECT_EQ(color[1], 65535);
    EXPECT_EQ(color[2], 0);
    EXPECT_NEAR(color[3] / 65535.0, 0.5, 1e-4);
}

/// From glTF's world to PLY's.
glm::dmat4 to_ply() {
    glm::dmat4 m(1.0);
    m[0][0] = m[1][1] = -1;
    return m;
}

void expect_near(const Gaussians& a, const Gaussians& b, double tolerance = 1e-5) {
    const Largest d = largest_differences(a, b);
    EXPECT_LE(std::max({d.mean, d.rotation, d.scale, d.opacity, d.color, d.sh}), tolerance);
}

TEST(GltfSplats, NodesTransformWithTheirParents) {
    const Gaussians g = storable_splats(1, 30, 3);
    GltfFile gltf(g);
    const double c = std::sqrt(0.5);
    gltf.top["nodes"] = {{{"children", {1}}, {"translation", {1, 2, 3}}, {"rotation", {0, c, 0, c}}},
                         {{"mesh", 0}, {"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1}}}};
    glm::dmat4 parent = glm::translate(glm::dmat4(1.0), glm::dvec3(1, 2, 3)) *
                        glm::rotate(glm::dmat4(1.0), std::acos(0.0), glm::dvec3(0, 1, 0));
    glm::dmat4 child = glm::scale(glm::translate(glm::dmat4(1.0), glm::dvec3(5, 6, 7)), glm::dvec3(2));
    Gaussians expected = g;
    transform_splats(expected, to_ply() * parent * child);
    expect_near(gltf.read().gaussians, expected);

    // Scales that differ, and a mirror.
    gltf.top["nodes"] = {{{"mesh", 0}, {"scale", {1, -2, 0.5}}, {"rotation", {0, c, 0, c}}}};
    expected = g;
    transform_splats(expected, to_ply() * glm::rotate(glm::dmat4(1.0), std::acos(0.0), glm::dvec3(0, 1, 0)) *
                                   glm::scale(glm::dmat4(1.0), glm::dvec3(1, -2, 0.5)));
    expect_near(gltf.read().gaussians, expected);
    gltf.top["nodes"][0]["scale"] = {1, 0, 1};
    gltf.refused({"node 0", "flattens"});
}

TEST(GltfSplats, SeveralNodesAndPrimitives) {
    const Gaussians g = storable_splats(1, 10, 1);
    GltfFile gltf(g);
    json plain = gltf.primitive();
    for (int k = 0; k < 3; ++k) plain["attributes"].erase(kPrefix + "SH_DEGREE_1_COEF_" + std::to_string(k));
    gltf.top["meshes"][0]["primitives"].push_back(plain);
    json mesh_only = gltf.primitive();
    mesh_only.erase("extensions");
    gltf.top["meshes"][0]["primitives"].push_back(mesh_only);
    gltf.top["nodes"].push_back({{"mesh", 0}, {"translation", {10, 0, 0}}});
    gltf.top["scenes"][0]["nodes"] = {0, 1};
    const SplatScene scene = gltf.read();
    EXPECT_EQ(scene.variant, "4 primitives");
    Gaussians expected = g, flat = g, moved = g;
    set_sh_degree(flat, 0);
    append_splats(expected, flat);
    append_splats(moved, flat);
    transform_splats(moved, glm::translate(to_ply(), glm::dvec3(10, 0, 0)));
    append_splats(expected, moved);
    expect_near(scene.gaussians, expected);
}

template <class T, class Value>
std::string quantised(size_t count, Value value) {
    std::string bytes;
    for (size_t i = 0; i < count; ++i) bytes += test::bytes_of(T(std::lround(value(i))));
    return bytes;
}

TEST(GltfSplats, QuantisedAccessors) {
    Gaussians g = storable_splats(1, 40, 0);
    for (size_t i = 0; i < 40; ++i) {
        double length = 0;
        for (size_t k = 0; k < 4; ++k) length += std::pow(g.quaternions[4 * i + k], 2);
        for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] /= float(std::sqrt(length));
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = float(std::log(1 + double(i + k)));
    }
    const auto rotation = [&](double range) {
        return [&g, range](size_t i) { return range * g.quaternions[4 * (i / 4) + (i + 1) % 4]; };
    };
    const auto opacity = [&](double range) {
        return [&g, range](size_t i) { return range / (1 + std::exp(-double(g.opacity_logits[i]))); };
    };
    const auto scale = [&](size_t i) { return std::exp(double(g.log_scales[i])); };
    constexpr int kByte = 5120, kUbyte = 5121, kShort = 5122, kUshort = 5123;
    GltfFile gltf(g);
    gltf.replace(kPrefix + "ROTATION", kByte, true, quantised<int8_t>(160, rotation(127)));
    gltf.replace(kPrefix + "OPACITY", kUbyte, true, quantised<uint8_t>(40, opacity(255)));
    gltf.replace(kPrefix + "SCALE", kUbyte, false, quantised<uint8_t>(120, scale));
    Largest d = largest_differences(g, gltf.read().gaussians);
    EXPECT_LE(d.rotation, 0.012);
    EXPECT_LE(d.opacity, 0.501 / 255);
    EXPECT_LE(d.scale, 1e-6);
    EXPECT_EQ(d.mean, 0);
    gltf.replace(kPrefix + "ROTATION", kShort, true, quantised<int16_t>(160, rotation(32767)));
    gltf.replace(kPrefix + "OPACITY", kUshort, true, quantised<uint16_t>(40, opacity(65535)));
    gltf.replace(kPrefix + "SCALE", kUshort, true,
                 quantised<uint16_t>(120, [&](size_t i) { return scale(i) / 50 * 65535; }));
    d = largest_differences(g, gltf.read().gaussians);
    EXPECT_LE(d.rotation, 1e-4);
    EXPECT_LE(d.opacity, 0.501 / 65535);
    EXPECT_NEAR(d.scale, std::log(50), 0.001);
    // With a stride: three bytes and one between.
    std::string strided;
    for (size_t i = 0; i < 40; ++i)
        strided += quantised<uint8_t>(3, [&](size_t k) { return scale(3 * i + k); }) + "\xff";
    gltf.replace(kPrefix + "SCALE", kUbyte, false, strided, 4);
    EXPECT_LE(largest_differences(g, gltf.read().gaussians).scale, 1e-6);
    gltf.replace(kPrefix + "OPACITY", kUbyte, false, quantised<uint8_t>(40, opacity(255)));
    gltf.refused({"OPACITY", "normalized"});
}

TEST(GltfSplats, OpacitiesOfZeroAndOneStayFinite) {
    Gaussians g = storable_splats(1, 2, 0);
    g.opacity_logits = {-90, 40};
    GltfFile gltf(g);
    const Gaussians back = gltf.read().gaussians;
    EXPECT_LT(back.opacity_logits[0], -60);
    EXPECT_GT(back.opacity_logits[1], 16);
    EXPECT_TRUE(drawable(back, 0) && drawable(back, 1));
}

TEST(GltfSplats, LinearColoursBecomeSrgb) {
    Gaussians g = storable_splats(1, 3, 1);
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) g.sh[12 * i + k] = float((0.21404 - 0.5) / 0.28209479177387814);
    GltfFile gltf(g);
    gltf.extension()["colorSpace"] = "lin_rec709_display";
    const SplatScene scene = gltf.read();
    ASSERT_EQ(scene.remarks.size(), 1u);
    EXPECT_NE(scene.remarks[0].find("linear light"), std::string::npos);
    EXPECT_NEAR(scene.gaussians.sh[0], 0, 1e-4);  // 0.5
    // sRGB's slope at 0.21404 by differences: (0.5 - 0.49902) over the linear values of both.
    EXPECT_NEAR(scene.gaussians.sh[3] / g.sh[3], 1.055 / 2.4 * std::pow(0.21404, 1 / 2.4 - 1), 1e-3);
}

TEST(GltfSplats, BuffersInsideAndBelowTheFolder) {
    const Gaussians g = storable_splats(1, 3, 0);
    GltfFile gltf(g);
    gltf.folder().write("below/some name.bin", gltf.buffer);
    gltf.top["buffers"][0]["uri"] = "below/some%20name.bin";
    expect_near(gltf.read().gaussians, g);
    for (const char* uri :
         {"../a.bin", "/etc/passwd", "below/../../a.bin", "file:///etc/passwd", "http://a/b"}) {
        gltf.top["buffers"][0]["uri"] = uri;
        gltf.refused({"buffer 0", uri, "leaves the file's folder"});
    }
    std::filesystem::create_symlink("/etc/passwd", gltf.folder() / "link.bin");
    gltf.top["buffers"][0]["uri"] = "link.bin";
    gltf.refused({"link.bin", "leaves the file's folder"});
    gltf.top["buffers"][0]["uri"] = "none.bin";
    gltf.refused({"none.bin"});
    gltf.top["buffers"][0].erase("uri");
    gltf.refused({"buffer 0", "\"uri\""});
    gltf.top["buffers"][0]["uri"] = "data:application/octet-stream;base64,AAAA";
    gltf.refused({"buffer 0", "byteLength", "3 bytes"});
}

TEST(GltfSplats, DataUri) {
    GltfFile gltf(storable_splats(1, 1, 0));
    gltf.primitive()["attributes"].erase("COLOR_0");
    // 56 zero bytes: 75 characters of base64 make 56.25, so 57.
    gltf.buffer = std::string(57, '\0');
    gltf.top["bufferViews"] = {{{"buffer", 0}, {"byteLength", 57}}};
    for (json& accessor : gltf.top["accessors"]) accessor["bufferView"] = 0;
    gltf.top["buffers"][0] = {{"byteLength", 57},
                              {"uri", "data:application/octet-stream;base64," + std::string(76, 'A')}};
    const Gaussians g = gltf.read().gaussians;
    ASSERT_EQ(g.size(), 1u);
    EXPECT_EQ(g.means, (std::vector<float>{0, 0, 0}));
    EXPECT_FALSE(drawable(g, 0));  // the quaternion is zero
}

TEST(GltfSplats, NamesWhatIsWrong) {
    const Gaussians g = storable_splats(1, 5, 2);
    const auto refuse = [&](const std::function<void(GltfFile&)>& change,
                            std::initializer_list<std::string> parts) {
        SCOPED_TRACE(*(parts.end() - 1));
        GltfFile gltf(g);
        change(gltf);
        gltf.refused(parts);
    };
    const auto erase = [&](const std::string& name) {
        return [name](GltfFile& f) { f.primitive()["attributes"].erase(name); };
    };
    for (const char* name : {"ROTATION", "SCALE", "OPACITY", "SH_DEGREE_0_COEF_0"})
        refuse(erase(kPrefix + name), {"mesh 0, primitive 0", name, "missing"});
    refuse(erase("POSITION"), {"POSITION"});
    refuse(erase(kPrefix + "SH_DEGREE_1_COEF_1"), {"SH degree 1", "missing"});
    refuse(erase(kPrefix + "SH_DEGREE_2_COEF_4"), {"SH degree 2", "missing"});
    refuse([](GltfFile& f) { f.extension()["kernel"] = "box"; }, {"kernel", "box"});
    refuse([](GltfFile& f) { f.extension()["colorSpace"] = 1; }, {"colorSpace"});
    refuse([](GltfFile& f) { f.extension()["colorSpace"] = "xyz"; }, {"xyz"});
    refuse([](GltfFile& f) { f.primitive().erase("extensions"); }, {"no primitive with the extension"});
    refuse([](GltfFile& f) { f.accessor("POSITION")["count"] = 6; }, {"POSITION", "6 elements do not fit"});
    refuse([](GltfFile& f) { f.accessor("POSITION")["count"] = 4; },
           {"ROTATION", "5 elements for 4 positions"});
    refuse([](GltfFile& f) { f.accessor("POSITION")["type"] = "VEC2"; }, {"POSITION", "type"});
    refuse([](GltfFile& f) { f.accessor("POSITION")["bufferView"] = 99; }, {"POSITION", "bufferView"});
    refuse([](GltfFile& f) { f.accessor("POSITION").erase("bufferView"); }, {"POSITION", "bufferView"});
    refuse([](GltfFile& f) { f.accessor("POSITION")["componentType"] = 5130; }, {"componentType"});
    refuse([](GltfFile& f) { f.top["bufferViews"][0]["byteOffset"] = 1000000000000000; },
           {"POSITION", "ends after its buffer"});
    refuse([](GltfFile& f) { f.top["bufferViews"][0]["byteStride"] = 4; }, {"POSITION", "byteStride"});
    refuse([](GltfFile& f) { f.top["buffers"][0]["byteLength"] = 1000000000000000; },
           {"buffer 0", "byteLength"});
    refuse([](GltfFile& f) { f.top["nodes"][0]["mesh"] = 5; }, {"node 0", "mesh"});
    refuse([](GltfFile& f) { f.top["nodes"][0]["children"] = {0}; }, {"node 0", "own ancestor"});
    refuse([](GltfFile& f) { f.top["scene"] = 3; }, {"scene", "3"});
    refuse([](GltfFile& f) { f.top.erase("asset"); }, {"asset"});
    refuse([](GltfFile& f) { f.buffer.pop_back(); }, {"buffer 0", "byteLength"});
    refuse([](GltfFile& f) { f.primitive()["attributes"]["POSITION"] = -4; }, {"POSITION", "accessor -4"});
}

TEST(GltfSplats, ClaimsAreBounded) {
    const Gaussians g = storable_splats(1, 5, 0);
    GltfFile gltf(g);
    // Every attribute on the same bytes again and again.
    for (json& accessor : gltf.top["accessors"]) accessor["count"] = 4000000000u;
    gltf.refused({"4000000000 elements do not fit"});
    GltfFile nested(g);
    std::string deep;
    for (int i = 0; i < 100000; ++i) deep += "[";
    expect_error<InputError>([&] { load_splats(nested.folder().write("deep.gltf", "{\"extras\":" + deep)); },
                             {"deep.gltf", "nests deeper"});
    // A library's error quotes the file; ours stay readable.
    try {
        load_splats(nested.folder().write("long.gltf", "{\"" + std::string(100000, 'x') + "\": nonsense}"));
        ADD_FAILURE() << "nothing was thrown";
    } catch (const InputError& error) {
        EXPECT_LT(std::string(error.what()).size(), 1000u);
    }
    // Time is that of the bytes, however many keys there are: of the processor, where quadratic time takes
    // minutes.
    std::string keys = "{\"asset\":{},\"x\":{";
    for (int i = 0; i < 30000; ++i) keys.append("\"").append(std::to_string(i)).append("\":{},");
    const std::clock_t begin = std::clock();
    expect_error<InputError>([&] { load_splats(nested.folder().write("keys.gltf", keys + "\"\":0}}")); },
                             {"keys.gltf"});
    EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, 10);
    GltfFile instanced(g);
    instanced.top["nodes"] = json::array();
    instanced.top["scenes"][0]["nodes"] = json::array();
    for (int i = 0; i < 5000; ++i) {
        instanced.top["nodes"].push_back({{"mesh", 0}});
        instanced.top["scenes"][0]["nodes"].push_back(i);
    }
    instanced.refused({"more than 4096 primitives"});
}

/// The same splats from a .glb with an SPZ as from the .spz of the same version.
TEST(GltfSplats, SpzInside) {
    const TempFolder folder;
    const Gaussians g = storable_splats(3, 60, 3);
    SaveOptions options;
    options.gltf_spz = options.antialiased = true;
    options.spz_version = 2;
    save_splats(folder / "a.glb", g, options);
    save_splats(folder / "a.spz", g, options);
    const SplatScene inside = read_splats(folder / "a.glb"), alone = read_splats(folder / "a.spz");
    EXPECT_TRUE(inside.antialiased);
    EXPECT_EQ(inside.gaussians.means, alone.gaussians.means);
    EXPECT_EQ(inside.gaussians.log_scales, alone.gaussians.log_scales);
    EXPECT_EQ(inside.gaussians.sh, alone.gaussians.sh);
    EXPECT_EQ(inside.gaussians.quaternions, alone.gaussians.quaternions);
    EXPECT_LT(largest_differences(g, inside.gaussians).rotation, 0.1);

    save_splats(folder / "b.gltf", g, options);
    json top = json::parse(test::file_bytes(folder / "b.gltf"));
    json& primitive = top["meshes"][0]["primitives"][0];
    json& extension = primitive["extensions"]["KHR_gaussian_splatting"];
    json& nested = extension["extensions"]["KHR_gaussian_splatting_compression_spz_2"];
    const json names = {"KHR_gaussian_splatting", "KHR_gaussian_splatting_compression_spz_2"};
    EXPECT_EQ(top["extensionsUsed"], names);
    EXPECT_EQ(top["extensionsRequired"], names);
    for (const json& accessor : top["accessors"]) EXPECT_FALSE(accessor.contains("bufferView"));
    // The values of SPZ's library for glTF: x and z are those of the .spz, negated.
    const json& bounds = top["accessors"][primitive["attributes"]["POSITION"].get<int>()];
    float left = 10;
    for (size_t i = 0; i < g.size(); ++i) left = std::min(left, -g.means[3 * i]);
    EXPECT_FLOAT_EQ(bounds["min"][0], left);
    const auto read = [&] { return read_splats(folder.write("b.gltf", top.dump())).gaussians; };
    EXPECT_EQ(read().means, alone.gaussians.means);
    // Cesium's older profile has no such turn.
    json older = top;
    older["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"] = {
        {"extensions", {{"KHR_gaussian_splatting_compression_spz_2", nested}}}};
    const Gaussians turned = read_splats(folder.write("b.gltf", older.dump())).gaussians;
    for (size_t i = 0; i < g.size(); ++i)
        for (size_t k = 0; k < 3; ++k)
            ASSERT_EQ(turned.means[3 * i + k], (k == 1 ? 1 : -1) * alone.gaussians.means[3 * i + k]);

    const auto refuse = [&](std::initializer_list<std::string> parts) {
        expect_error<InputError>([&] { read(); }, parts);
    };
    nested["bufferView"] = 9;
    refuse({"b.gltf", "bufferView"});
    nested["bufferView"] = 0;
    extension["kernel"] = "cube";
    refuse({"kernel"});
    extension["kernel"] = "ellipse";
    top["accessors"][primitive["attributes"]["POSITION"].get<int>()]["count"] = 61;
    refuse({"60 splats", "61"});
    top["accessors"][primitive["attributes"]["POSITION"].get<int>()]["count"] = 60;
    top["bufferViews"][0]["byteLength"] = 40;
    refuse({"b.gltf", "the SPZ", "byte"});
}

/// An SPZ that many nodes place is unpacked once, however long its bytes are.
TEST(GltfSplats, ASpzOfManyPlacementsIsUnpackedOnce) {
    const TempFolder folder;
    SaveOptions options;
    options.gltf_spz = true;
    const Gaussians g = storable_splats(3, 2, 0);
    save_splats(folder / "a.gltf", g, options);
    json top = json::parse(test::file_bytes(folder / "a.gltf"));
    std::string spz = test::file_bytes(folder / "a.bin");
    // A gzip header may have a file name of any length before the data.
    const std::string name(2'000'000, 'n');
    spz[3] |= 8;
    spz.insert(10, name + '\0');
    top["buffers"][0]["byteLength"] = spz.size();
    top["bufferViews"][0]["byteLength"] = spz.size();
    folder.write("a.bin", spz);
    constexpr size_t kPlacements = 2000;
    top["nodes"] = json::array();
    top["scenes"][0]["nodes"] = json::array();
    for (size_t i = 0; i < kPlacements; ++i) {
        top["nodes"].push_back({{"mesh", 0}, {"translation", {i, 0, 0}}});
        top["scenes"][0]["nodes"].push_back(i);
    }
    const auto file = folder.write("a.gltf", top.dump());
    const std::clock_t begin = std::clock();
    const Gaussians all = load_splats(file);
    EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, 1);
    ASSERT_EQ(all.size(), kPlacements * g.size());
    for (size_t i = 0; i < kPlacements; ++i)
        ASSERT_NEAR(all.means[6 * i] + double(i), all.means[0], 1e-3) << i;
}

/// One splat of SH degree 3 gives all others its coefficients: their memory is bounded too.
TEST(GltfSplats, ASpzOfAHigherDegreeIsBounded) {
    const TempFolder folder;
    SaveOptions options;
    options.gltf_spz = true;
    Gaussians many;
    many.resize(500'000);
    for (size_t i = 0; i < many.size(); ++i) many.quaternions[4 * i] = 1;
    save_splats(folder / "many.gltf", many, options);
    save_splats(folder / "one.gltf", storable_splats(3, 1, 3), options);
    json top = json::parse(test::file_bytes(folder / "many.gltf"));
    const json one = json::parse(test::file_bytes(folder / "one.gltf"));
    const size_t accessors = top["accessors"].size();
    for (const json& accessor : one["accessors"]) top["accessors"].push_back(accessor);
    json primitive = one["meshes"][0]["primitives"][0];
    for (auto& attribute : primitive["attributes"]) attribute = attribute.get<size_t>() + accessors;
    primitive["extensions"]["KHR_gaussian_splatting"]["extensions"]
             ["KHR_gaussian_splatting_compression_spz_2"]["bufferView"] = 1;
    top["meshes"][0]["primitives"].push_back(primitive);
    top["buffers"].push_back(one["buffers"][0]);
    top["bufferViews"].push_back(one["bufferViews"][0]);
    top["bufferViews"][1]["buffer"] = 1;
    expect_error<InputError>([&] { load_splats(folder.write("both.gltf", top.dump())); },
                             {"500001 splats of SH degree 3"});
}

TEST(GltfSplats, GlbChunks) {
    TempFolder folder;
    save_splats(folder / "a.glb", storable_splats(1, 5, 0));
    const std::string good = test::file_bytes(folder / "a.glb");
    const auto refuse = [&](size_t at, uint32_t value, std::initializer_list<std::string> parts) {
        std::string bytes = good;
        bytes.replace(at, 4, test::bytes_of(value));
        expect_error<InputError>([&] { load_splats(folder.write("b.glb", bytes)); }, parts);
    };
    refuse(4, 1, {"b.glb", "byte", "GLB version 1"});
    refuse(8, 1u << 30, {"byte", "truncated"});
    refuse(12, 0xffffffff, {"byte", "JSON claims"});
    refuse(16, 7, {"byte", "not JSON"});
    uint32_t json_bytes;
    std::memcpy(&json_bytes, good.data() + 12, 4);
    refuse(20 + json_bytes, 0x7fffffff, {"byte", "second chunk claims"});
    refuse(24 + json_bytes, 7, {"byte", "not BIN"});
    refuse(20, 0x20202020, {"byte", "not valid JSON"});
}

/// Gives attributes the names of the drafts of 2025.
void use_draft_names(GltfFile& f) {
    json renamed = json::object();
    for (const auto& [name, index] : f.primitive()["attributes"].items())
        renamed[name.starts_with(kPrefix) ? "_" + name.substr(kPrefix.size()) : name] = index;
    f.primitive()["attributes"] = renamed;
}

/// The remarks of a scene as one text.
std::string remarks_of(const SplatScene& scene) {
    std::string text;
    for (const std::string& line : scene.remarks) text += line + "\n";
    return text;
}

TEST(GltfSplats, EarlierDrafts) {
    const Gaussians g = storable_splats(1, 50, 2);
    {
        GltfFile f(g);
        use_draft_names(f);
        f.extension() = json::object();
        expect_near(f.read().gaussians, g);
        f.extension()["colorSpace"] = "BT.709-sRGB";
        expect_near(f.read().gaussians, g);
        f.extension()["colorSpace"] = "BT.709-linear";
        EXPECT_NE(remarks_of(f.read()).find("linear light"), std::string::npos);
    }
    // COLOR_0 alone: sRGB values and opacities.
    std::string colors;
    for (size_t i = 0; i < g.size(); ++i)
        for (const float v : {0.25f, 0.5f, 1.0f, 0.75f}) colors += test::bytes_of(v);
    for (const bool names : {true, false}) {
        GltfFile f(g);
        f.replace("COLOR_0", 5126, false, colors);
        for (const char* name : {"OPACITY", "SH_DEGREE_0_COEF_0"})
            f.primitive()["attributes"].erase(kPrefix + name);
        if (names) use_draft_names(f);
        const Gaussians back = f.read().gaussians;
        for (size_t i = 0; i < g.size(); ++i) {
            EXPECT_NEAR(back.sh[27 * i] * 0.28209479177387814 + 0.5, 0.25, 1e-6);
            EXPECT_NEAR(back.opacity_logits[i], std::log(3.0), 1e-5);
            EXPECT_EQ(back.sh[27 * i + 5], g.sh[27 * i + 5]);
        }
    }
}

TEST(GltfSplats, ScalesOfADraftAreLogarithms) {
    const Gaussians g = storable_splats(1, 50, 0);
    GltfFile f(g);
    std::string bytes;
    for (const float v : g.log_scales) bytes += test::bytes_of(v);
    f.replace(kPrefix + "SCALE", 5126, false, bytes);
    const SplatScene scene = f.read();
    EXPECT_EQ(scene.gaussians.log_scales, g.log_scales);
    EXPECT_NE(remarks_of(scene).find("logarithms"), std::string::npos);
    // One wrong value does not change what the others mean.
    bytes.clear();
    for (size_t i = 0; i < g.log_scales.size(); ++i)
        bytes += test::bytes_of(i == 4 ? -1.0f : std::exp(g.log_scales[i]));
    GltfFile one(g);
    one.replace(kPrefix + "SCALE", 5126, false, bytes);
    const Gaussians back = one.read().gaussians;
    EXPECT_EQ(scene::undrawable_text(back), "scales of 1");
    EXPECT_NEAR(back.log_scales[7], g.log_scales[7], 1e-5);
}

TEST(GltfSplats, OpacitiesThatMayBeLogitsAreNoted) {
    const Gaussians g = storable_splats(1, 50, 0);
    GltfFile f(g);
    EXPECT_EQ(remarks_of(f.read()), "");
    std::string bytes;
    for (size_t i = 0; i < g.size(); ++i) bytes += test::bytes_of(i % 2 == 0 ? -3.0f : 5.0f);
    f.replace(kPrefix + "OPACITY", 5126, false, bytes);
    const SplatScene scene = f.read();
    EXPECT_NE(remarks_of(scene).find("50 opacities outside of 0..1 are clamped"), std::string::npos);
    EXPECT_NE(remarks_of(scene).find("logits"), std::string::npos);
}

TEST(GltfSplats, RequiredExtensionsThatAreNotReadAreRefusedByName) {
    const Gaussians g = storable_splats(1, 20, 0);
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression",
                             "KHR_draco_mesh_compression", "KHR_gaussian_splatting_compression_other"}) {
        GltfFile f(g);
        f.top["extensionsRequired"] = {"KHR_gaussian_splatting", name};
        f.top["buffers"].push_back({{"byteLength", 16}});  // a fallback without content
        f.refused({"a.gltf: \"extensionsRequired\"", name, "uncompressed"});
    }
    GltfFile f(g);
    f.top["extensionsRequired"] = {"KHR_gaussian_splatting", "KHR_mesh_quantization", "KHR_materials_unlit"};
    expect_near(f.read().gaussians, g);
}

TEST(GltfSplats, SpzOfEarlierDrafts) {
    const Gaussians g = storable_splats(2, 30, 0);
    const TempFolder folder;
    save_splats(folder / "a.gltf", g, SaveOptions{.gltf_spz = true});
    const Gaussians expected = load_splats(folder / "a.gltf");
    const json whole = json::parse(test::file_bytes(folder / "a.gltf"));
    for (const char* name : {"KHR_spz_gaussian_splats_compression", "KHR_gaussian_splatting_compression_spz"})
        for (const bool beside : {true, false}) {
            json top = whole;
            json& extensions = top["meshes"][0]["primitives"][0]["extensions"];
            json& base = extensions["KHR_gaussian_splatting"];
            const json view = base["extensions"]["KHR_gaussian_splatting_compression_spz_2"];
            base.erase("extensions");
            if (beside)
                extensions[name] = view;
            else
                base["extensions"][name] = view;
            top["extensionsRequired"] = {"KHR_gaussian_splatting", name};
            EXPECT_EQ(load_splats(folder.write("b.gltf", top.dump())).means, expected.means)
                << name << beside;
        }
}

}  // namespace
