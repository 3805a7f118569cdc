// SPDX-License-Identifier: Apache-2.0
// glTF scenes of triangles: indices of every type, strips and fans, nodes, materials, cameras, lights, sky,
// and damage.
#include <gtest/gtest.h>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "ewa/synthetic_dataset.h"
#include "image/image_files.h"
#include "io/gltf/mesh.h"
#include "pathtracer/path_tracer.h"
#include "pathtracer/synthetic_dataset.h"
#include "pathtracer/virtual_camera.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using nlohmann::json;
using test::expect_error;
using test::TempFolder;

template <class T>
std::string bytes_of_list(std::initializer_list<T> values) {
    std::string bytes;
    for (const T value : values) bytes += test::bytes_of(value);
    return bytes;
}

/// A .gltf with its buffer beside it: one triangle (0,0,0) (1,0,0) (0,2,0) in one node.
class Gltf {
  public:
    Gltf() {
        top = {{"asset", {{"version", "2.0"}}},
               {"scene", 0},
               {"scenes", {{{"nodes", {0}}}}},
               {"nodes", {{{"mesh", 0}}}},
               {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}}}},
               {"accessors", json::array()},
               {"bufferViews", json::array()}};
        add(bytes_of_list<float>({0, 0, 0, 1, 0, 0, 0, 2, 0}), 5126, "VEC3", 3);
    }
    /// The accessor's number.
    int add(const std::string& bytes, int component, const char* type, int count) {
        buffer.resize((buffer.size() + 3) / 4 * 4);
        top["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}});
        top["accessors"].push_back({{"bufferView", top["bufferViews"].size() - 1},
                                    {"componentType", component},
                                    {"type", type},
                                    {"count", count}});
        buffer += bytes;
        return int(top["accessors"].size()) - 1;
    }
    json& primitive() { return top["meshes"][0]["primitives"][0]; }
    json& node() { return top["nodes"][0]; }
    scene::MeshScene read() {
        top["buffers"] = {{{"uri", "a.bin"}, {"byteLength", buffer.size()}}};
        folder.write("a.bin", buffer);
        return io::read_gltf_mesh(folder.write("a.gltf", top.dump()));
    }
    void refused(std::initializer_list<std::string> parts) {
        expect_error<InputError>([&] { read(); }, parts);
    }

    json top;
    std::string buffer;
    TempFolder folder;
};

void expect_corners(const scene::Triangle& t, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    EXPECT_EQ(t.corners[0], a);
    EXPECT_EQ(t.corners[1], b);
    EXPECT_EQ(t.corners[2], c);
}

TEST(GltfMesh, IndicesOfEveryTypeStripsAndFans) {
    Gltf plain;
    const scene::MeshScene scene = plain.read();
    ASSERT_EQ(scene.triangles.size(), 1u);
    expect_corners(scene.triangles[0], {0, 0, 0}, {1, 0, 0}, {0, 2, 0});
    EXPECT_EQ(scene.triangles[0].normals[0], scene::kNoNormal);

    const std::pair<int, std::string> types[] = {{5121, bytes_of_list<uint8_t>({2, 0, 1})},
                                                 {5123, bytes_of_list<uint16_t>({2, 0, 1})},
                                                 {5125, bytes_of_list<uint32_t>({2, 0, 1})}};
    for (const auto& [component, bytes] : types) {
        Gltf gltf;
        gltf.primitive()["indices"] = gltf.add(bytes, component, "SCALAR", 3);
        const scene::MeshScene read = gltf.read();
        ASSERT_EQ(read.triangles.size(), 1u) << component;
        expect_corners(read.triangles[0], {0, 2, 0}, {0, 0, 0}, {1, 0, 0});
    }
    for (const int mode : {5, 6}) {
        Gltf gltf;
        gltf.primitive()["mode"] = mode;
        gltf.primitive()["attributes"]["POSITION"] =
            gltf.add(bytes_of_list<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}), 5126, "VEC3", 4);
        const scene::MeshScene read = gltf.read();
        ASSERT_EQ(read.triangles.size(), 2u) << mode;
        if (mode == 5)
            expect_corners(read.triangles[1], {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
        else
            expect_corners(read.triangles[1], {0, 0, 0}, {0, 1, 0}, {1, 1, 0});
    }
}

TEST(GltfMesh, NodesPlaceTurnScaleAndMirror) {
    Gltf gltf;
    gltf.top["scenes"][0]["nodes"] = {1, 2};
    gltf.top["nodes"] = {
        {{"mesh", 0}, {"translation", {10, 0, 0}}},
        {{"children", {0}}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}, {"scale", {2, 2, 2}}},
        {{"mesh", 0}, {"scale", {-1, 1, 1}}}};
    gltf.primitive()["attributes"]["NORMAL"] =
        gltf.add(bytes_of_list<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}), 5126, "VEC3", 3);
    const scene::MeshScene scene = gltf.read();
    ASSERT_EQ(scene.triangles.size(), 2u);
    EXPECT_LT(glm::length(scene.triangles[0].corners[1] - glm::dvec3(0, 22, 0)), 1e-9);
    // Mirrored: the corners change places, so that the front stays in front, and so does the normal.
    expect_corners(scene.triangles[1], {0, 2, 0}, {-1, 0, 0}, {0, 0, 0});
    EXPECT_EQ(scene.triangles[1].normals[0], scene::pack_normal({0, 0, 1}));
}

TEST(GltfMesh, MaterialsAndTheirExtensions) {
    Gltf gltf;
    gltf.primitive()["material"] = 1;
    gltf.top["materials"] = {
        {{"name", "unused"}},
        {{"pbrMetallicRoughness",
          {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.6}}},
         {"emissiveFactor", {1, 0.5, 0}},
         {"alphaMode", "MASK"},
         {"alphaCutoff", 0.25},
         {"doubleSided", true},
         {"extensions",
          {{"KHR_materials_emissive_strength", {{"emissiveStrength", 4}}},
           {"KHR_materials_ior", {{"ior", 3}}},
           {"KHR_materials_specular", {{"specularFactor", 0.5}}}}}}};
    scene::MeshScene scene = gltf.read();
    const scene::Material& m = scene.materials[scene.triangles[0].material];
    EXPECT_EQ(m.base, glm::vec3(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(m.opacity, 0.4f);
    EXPECT_EQ(m.metallic, 0.0f);
    EXPECT_EQ(m.roughness, 0.6f);
    EXPECT_EQ(m.emitted, glm::vec3(4, 2, 0));
    EXPECT_FLOAT_EQ(m.f0, 0.125f);
    EXPECT_FLOAT_EQ(m.f90, 0.5f);
    EXPECT_TRUE(m.masked && m.two_sided && !m.blended);
    EXPECT_EQ(m.cutoff, 0.25f);
    EXPECT_TRUE(scene::color_depends_on_view(scene));
    gltf.top["materials"][1]["extensions"]["KHR_materials_specular"]["specularFactor"] = 0;
    EXPECT_FALSE(scene::color_depends_on_view(gltf.read())) << "unused materials do not count";
    gltf.top["materials"][1]["extensions"] = {{"KHR_materials_unlit", json::object()}};
    scene = gltf.read();
    EXPECT_EQ(scene.materials[1].emitted, glm::vec3(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(scene.materials[1].base, glm::vec3(0));
    EXPECT_FALSE(scene::color_depends_on_view(scene));
}

TEST(GltfMesh, TexturesFromFilesViewsAndUris) {
    Image picture(3, 2, 3);
    for (size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = float(i * 10) / 255;
    const std::vector<unsigned char> png = image::encode_png(picture);
    const std::string text(png.begin(), png.end());
    Gltf gltf;
    gltf.folder.write("pictures/a b.png", text);
    const int view = gltf.add(text, 5121, "SCALAR", int(text.size()));
    gltf.top["images"] = {
        {{"uri", "pictures/a%20b.png"}},
        {{"bufferView", gltf.top["accessors"][size_t(view)]["bufferView"]}, {"mimeType", "image/png"}}};
    gltf.top["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
    gltf.top["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"source", 1}}};
    gltf.top["materials"] = {
        {{"pbrMetallicRoughness",
          {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 1}}}}},
         {"emissiveTexture", {{"index", 0}}}}};
    gltf.primitive()["material"] = 0;
    gltf.primitive()["attributes"]["TEXCOORD_0"] =
        gltf.add(bytes_of_list<float>({0, 0, 1, 0, NAN, 1}), 5126, "VEC2", 3);
    const scene::MeshScene scene = gltf.read();
    ASSERT_EQ(scene.textures.size(), 2u);
    EXPECT_EQ(scene.textures[0].wrap_s, shared::WRAP_CLAMP);
    EXPECT_EQ(scene.textures[0].wrap_t, shared::WRAP_MIRROR);
    EXPECT_TRUE(scene.textures[0].nearest);
    EXPECT_EQ(scene.materials[0].base_texture, scene.materials[0].emitted_texture);
    EXPECT_EQ(scene.triangles[0].uvs[1], glm::vec2(1, 0));
    EXPECT_EQ(scene.triangles[0].uvs[2], glm::vec2(0, 1)) << "what is not finite is 0";
    const std::vector<Image> images = pathtracer::decode_images(scene);
    ASSERT_EQ(images.size(), 2u);
    for (const Image& image : images) EXPECT_EQ(image.pixels, picture.pixels);

    gltf.top["images"][0]["uri"] = "../a.png";
    gltf.refused({"image 0", "leaves the file's folder"});
    gltf.top["images"][0]["uri"] = "none.png";
    gltf.refused({"image 0", "\"uri\""});
    gltf.folder.write("none.png", text.substr(0, 30));
    expect_error<InputError>([&] { pathtracer::decode_images(gltf.read()); }, {"a.gltf: image 0: ", "PNG"});
    gltf.folder.write("none.png", "GIF89a");
    expect_error<InputError>([&] { pathtracer::decode_images(gltf.read()); },
                             {"image 0", "neither PNG nor JPEG"});
    gltf.top["textures"][0]["source"] = 5;
    gltf.refused({"texture 0", "\"source\""});
}

TEST(GltfMesh, AKnownVertexLandsOnItsPixel) {
    // Corner (0, 2, 0) through a camera at (0, 2, 5) + turned 90 degrees about y: it looks along -x from (5,
    // 2, 0).
    Gltf gltf;
    gltf.top["cameras"] = {
        {{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.1}, {"aspectRatio", 2}}}},
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"zfar", 9}, {"znear", 1}}}}};
    gltf.top["nodes"].push_back({{"camera", 0},
                                 {"name", "side"},
                                 {"translation", {5, 1, -1}},
                                 {"scale", {3, 3, 3}},
                                 {"rotation", {0, std::sqrt(0.5), 0, std::sqrt(0.5)}}});
    gltf.top["nodes"].push_back({{"camera", 1}});
    gltf.top["scenes"][0]["nodes"] = {0, 1, 2};
    const scene::MeshScene scene = gltf.read();
    ASSERT_EQ(scene.cameras.size(), 1u);
    EXPECT_EQ(scene.cameras[0].name, "side");
    EXPECT_EQ(scene.remarks.size(), 1u);
    const Camera camera = pathtracer::pinhole_of(scene.cameras[0], 200, 100);
    const glm::dvec3 seen = camera.rotation * scene.triangles[0].corners[2] + camera.translation;
    const double focal = 50 / std::tan(0.4);
    // Right of the camera is -z in the world: the corner stands 1 to the left and 1 above, 5 ahead.
    EXPECT_NEAR(camera.fx * seen.x / seen.z + camera.cx, 100 - focal / 5, 1e-9);
    EXPECT_NEAR(camera.fy * seen.y / seen.z + camera.cy, 50 - focal / 5, 1e-9);
    gltf.top["cameras"][0]["perspective"]["yfov"] = 4;
    gltf.refused({"camera 0", "\"yfov\""});
}

TEST(GltfMesh, LightsAndSky) {
    Gltf gltf;
    gltf.top["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"},
                                                                {"intensity", 10},
                                                                {"color", {1, 0.5, 0}},
                                                                {"range", 7},
                                                                {"spot", {{"outerConeAngle", 0.5}}}}};
    gltf.top["extensionsRequired"] = {"KHR_lights_punctual"};
    gltf.node()["extensions"]["KHR_lights_punctual"]["light"] = 0;
    gltf.node()["translation"] = {1, 2, 3};
    gltf.node()["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // -z becomes -y
    gltf.top["scenes"][0]["extras"]["sky"] = {{"zenith", {1, 2, 3}}};
    const scene::MeshScene scene = gltf.read();
    ASSERT_EQ(scene.lights.size(), 1u);
    EXPECT_EQ(scene.lights[0].kind, shared::LIGHT_SPOT);
    EXPECT_EQ(scene.lights[0].intensity, glm::dvec3(10, 5, 0));
    EXPECT_EQ(scene.lights[0].position, glm::dvec3(1, 2, 3));
    EXPECT_LT(glm::length(scene.lights[0].direction - glm::dvec3(0, -1, 0)), 1e-9);
    EXPECT_EQ(scene.lights[0].outer, 0.5);
    EXPECT_EQ(scene.sky.zenith, glm::vec3(1, 2, 3));
    EXPECT_EQ(scene.sky.ground, scene::Sky().ground);
    gltf.top["scenes"][0]["extras"]["sky"]["zenith"] = {1, 2};
    gltf.refused({"\"sky\"", "\"zenith\""});
    for (const json& light : {json(1), json(-1), json("a"), json()}) {
        gltf.node()["extensions"]["KHR_lights_punctual"]["light"] = light;
        gltf.refused({"node 0: KHR_lights_punctual: \"light\""});
    }
    gltf.node()["extensions"]["KHR_lights_punctual"] = json::array();
    gltf.refused({"node 0: KHR_lights_punctual: \"light\""});
}

TEST(GltfMesh, ContentsThatARenderDoesNotShowAreRemarked) {
    Gltf gltf;
    EXPECT_TRUE(gltf.read().remarks.empty());
    gltf.top["materials"] = {
        {{"extensions",
          {{"KHR_materials_specular", {{"specularColorFactor", {1, 0.5, 0.5}}, {"specularFactor", 0.5}}},
           {"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}},
           {"KHR_materials_ior", {{"ior", 1.4}}}}}}};
    gltf.primitive()["material"] = 0;
    gltf.top["extensionsUsed"] = {"KHR_materials_specular", "KHR_materials_clearcoat", "KHR_materials_ior",
                                  "EXT_mesh_gpu_instancing"};
    const auto pose = gltf.add(bytes_of_list<float>({0, 1}), 5126, "SCALAR", 2);
    const auto turns = gltf.add(bytes_of_list<float>({0, 0, 0, 1, 1, 1}), 5126, "VEC3", 2);
    gltf.top["animations"] = {
        {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
         {"samplers", {{{"input", pose}, {"output", turns}}}}}};
    EXPECT_EQ(
        gltf.read().remarks,
        (std::vector<std::string>{"KHR_materials_clearcoat is skipped", "EXT_mesh_gpu_instancing is skipped",
                                  "animations are skipped: the pose is the one the file stores",
                                  "KHR_materials_specular: specularColorFactor is skipped"}));
}

TEST(GltfMesh, DamageIsNamed) {
    {
        Gltf gltf;
        gltf.top["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}}};
        gltf.refused({"\"spot\""});
        gltf.top["extensions"] = json::object();
        gltf.top["cameras"] = {{{"type", "perspective"}}};
        gltf.refused({"\"perspective\""});
        gltf.top["cameras"] = {{{"type", "orthographic"}}};
        gltf.refused({"\"orthographic\""});
    }
    {
        Gltf gltf;
        gltf.primitive()["indices"] = gltf.add(bytes_of_list<uint16_t>({0, 1, 3}), 5123, "SCALAR", 3);
        gltf.refused({"mesh 0, primitive 0, indices", "\"3\"", "3 positions"});
        gltf.primitive()["indices"] = gltf.add(bytes_of_list<float>({0, 1, 2}), 5126, "SCALAR", 3);
        gltf.refused({"indices", "\"componentType\""});
        gltf.primitive()["indices"] = 77;
        gltf.refused({"indices", "accessor"});
    }
    {
        Gltf gltf;
        gltf.top["accessors"][0]["count"] = 1000000000;
        gltf.refused({"POSITION", "do not fit"});
    }
    {
        Gltf gltf;
        gltf.top["extensionsRequired"] = {"KHR_draco_mesh_compression"};
        gltf.refused({"KHR_draco_mesh_compression", "not supported"});
    }
    {
        Gltf gltf;
        gltf.primitive()["material"] = 0;
        gltf.refused({"\"material\" 0"});
        gltf.top["materials"] = {{{"pbrMetallicRoughness", {{"roughnessFactor", -1}}}}};
        gltf.refused({"material 0", "\"roughnessFactor\""});
    }
    {
        Gltf gltf;
        gltf.primitive()["mode"] = 0;
        gltf.refused({"no \"mesh\" of triangles"});
        gltf.primitive()["extensions"]["KHR_gaussian_splatting"] = json::object();
        gltf.refused({"KHR_gaussian_splatting"});
    }
}

TEST(GltfMesh, TrianglesThatAreNotFiniteAreCounted) {
    Gltf gltf;
    gltf.primitive()["attributes"]["POSITION"] =
        gltf.add(bytes_of_list<float>({0, 0, 0, 1, 0, 0, 0,        1, 0, NAN, 0, 0, 1, 0,
                                       0, 0, 1, 0, 0, 0, INFINITY, 1, 0, 0,   0, 1, 0}),
                 5126, "VEC3", 9);
    const scene::MeshScene scene = gltf.read();
    EXPECT_EQ(scene.triangles.size(), 1u);
    EXPECT_EQ(scene.dropped_triangles, 2u);
    gltf.node()["scale"] = {1e300, 1, 1};
    gltf.refused({"all finite"});
}

TEST(GltfMesh, InstancesDoNotUnpackToMoreThanAFileAccountsFor) {
    Gltf gltf;
    std::string many;
    for (int i = 0; i < 3000; ++i) many += bytes_of_list<uint8_t>({0, 1, 2});
    gltf.primitive()["indices"] = gltf.add(many, 5121, "SCALAR", 9000);
    gltf.top["nodes"] = json::array();
    gltf.top["scenes"][0]["nodes"] = json::array();
    for (int i = 0; i < 500; ++i) {
        gltf.top["nodes"].push_back({{"mesh", 0}});
        gltf.top["scenes"][0]["nodes"].push_back(i);
    }
    gltf.refused({"instances are too many"});
    // Triangles that are left out take as long to read.
    gltf.primitive()["attributes"]["POSITION"] =
        gltf.add(bytes_of_list<float>({NAN, 0, 0, 1, 0, 0, 0, 1, 0}), 5126, "VEC3", 3);
    gltf.refused({"instances are too many"});
}

TEST(GltfMesh, WhatIsAMeshScene) {
    Gltf gltf;
    gltf.read();
    EXPECT_TRUE(is_mesh_scene(gltf.folder / "a.gltf"));
    EXPECT_FALSE(is_mesh_scene(gltf.folder / "a.bin"));
    EXPECT_FALSE(is_mesh_scene(gltf.folder / "none"));
    gltf.primitive()["extensions"]["KHR_gaussian_splatting"] = json::object();
    gltf.folder.write("b.gltf", gltf.top.dump());
    EXPECT_FALSE(is_mesh_scene(gltf.folder / "b.gltf"));
}

TEST(GltfMesh, EveryCutOfAFileIsReadOrRefused) {
    Gltf gltf;
    gltf.read();
    const std::filesystem::path path = gltf.folder / "a.gltf";
    EXPECT_EQ(test::read_every_cut(path, test::file_bytes(path), [&] { io::read_gltf_mesh(path); }), 0u);
}

}  // namespace
