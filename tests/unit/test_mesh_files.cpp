// SPDX-License-Identifier: Apache-2.0
// Meshes in .ply and .obj: what is read, and errors.
#include <gtest/gtest.h>

#include <cmath>

#include "ewa/error.h"
#include "io/gltf/mesh.h"
#include "io/meshes/mesh_files.h"
#include "mesh/distance.h"
#include "mesh/mesh_files.h"
#include "mesh/parts.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::expect_error;
using test::TempFolder;
using Corners = std::vector<std::array<glm::dvec3, 3>>;

const std::filesystem::path kSeeds = EWA_SOURCE_DIR "/tests/fuzz/seeds";

Corners corners_of(const scene::MeshScene& scene) {
    Corners out;
    for (const scene::Triangle& t : scene.triangles) out.push_back(t.corners);
    return out;
}

Corners read_obj(const TempFolder& folder, const std::string& text) {
    return corners_of(io::read_obj_mesh(folder.write("a.obj", text)));
}

/// A cube without its top: five squares of two triangles.
void expect_open_cube(const std::filesystem::path& path) {
    const scene::MeshScene scene = io::read_mesh(path);
    ASSERT_EQ(scene.triangles.size(), 10u) << path;
    EXPECT_NEAR(mesh::Surface(scene).area(), 5, 1e-12) << path;
    const mesh::Topology topology = mesh::topology_of(mesh::joined(scene));
    EXPECT_EQ(topology.parts, 1u) << path;
    EXPECT_EQ(topology.border_edges, 4u) << path;
    EXPECT_EQ(topology.crowded_edges, 0u) << path;
}

TEST(MeshReaders, FacesOfFourCornersBecomeTwoTriangles) {
    expect_open_cube(kSeeds / "read_ply_mesh" / "quads.ply");
    expect_open_cube(kSeeds / "read_obj_mesh" / "cube.obj");
}

TEST(MeshReaders, BinaryPlyOfBothByteOrders) {
    const scene::MeshScene little = io::read_mesh(kSeeds / "read_ply_mesh" / "little.ply");
    const scene::MeshScene big = io::read_mesh(kSeeds / "read_ply_mesh" / "big.ply");
    ASSERT_EQ(little.triangles.size(), 4u);
    EXPECT_EQ(little.dropped_triangles, 1u) << "a corner is not a number";
    EXPECT_EQ(corners_of(little), corners_of(big));
    EXPECT_EQ(little.triangles[1].corners[2], glm::dvec3(0, 0, 1));
    EXPECT_TRUE(mesh::topology_of(mesh::joined(little)).watertight());
}

TEST(MeshReaders, WhatEwaWritesIsTheSameInAllFormats) {
    const TempFolder folder;
    scene::TriangleMesh m;
    m.origin = {5000, 1, -2};
    for (int i = 0; i < 30; ++i) {
        m.positions.emplace_back(std::sin(float(i)), std::cos(float(3 * i)), 0.1f * float(i));
        m.normals.emplace_back(0, 0, 1);
        m.colors.push_back({uint8_t(i), 100, 200});
        if (i > 1) m.triangles.push_back({uint32_t(i - 2), uint32_t(i - 1), uint32_t(i)});
    }
    for (const char* name : {"a.ply", "a.obj", "a.glb"}) {
        mesh::save_mesh(folder / name, m);
        EXPECT_TRUE(io::is_mesh(folder / name)) << name;
        const Corners read = corners_of(io::read_mesh(folder / name));
        ASSERT_EQ(read.size(), m.triangles.size()) << name;
        for (size_t i = 0; i < read.size(); ++i)
            for (size_t k = 0; k < 3; ++k) {
                const glm::dvec3 at = m.origin + glm::dvec3(m.positions[m.triangles[i][k]]);
                EXPECT_LT(glm::length(read[i][k] - at), 1e-5) << name;
            }
    }
}

TEST(MeshReaders, AGlbAndAnObjStandUprightAndComeBack) {
    const TempFolder folder;
    scene::TriangleMesh m;
    m.origin = {1, 2, 3};
    m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    m.normals.assign(3, {0, 0, 1});
    m.triangles = {{0, 1, 2}};
    const std::pair<glm::dvec3, glm::dvec3> cases[] = {// up, where origin + (1, 0, 0) is in the file
                                                       {{0, -1, 0}, {-2, -2, 3}}, {{0, 1, 0}, {2, 2, 3}},
                                                       {{0, 0, 1}, {2, 3, -2}},   {{0, 0, -1}, {2, -3, 2}},
                                                       {{1, 0, 0}, {-2, 2, 3}},   {{-1, 0, 0}, {2, -2, 3}}};
    for (const auto& [up, wanted] : cases) {
        mesh::save_mesh(folder / "a.glb", m, up);
        EXPECT_LT(glm::length(io::read_gltf_mesh(folder / "a.glb").triangles.at(0).corners[1] - wanted),
                  1e-12);
        mesh::save_mesh(folder / "a.obj", m, up);
        std::string text = test::file_bytes(folder / "a.obj");
        text.replace(0, text.find('\n'), "# another program");
        folder.write("b.obj", text);
        EXPECT_LT(glm::length(io::read_mesh(folder / "b.obj").triangles.at(0).corners[1] - wanted), 1e-12);
        for (const char* name : {"a.glb", "a.obj"})
            EXPECT_LT(
                glm::length(io::read_mesh(folder / name).triangles.at(0).corners[1] - glm::dvec3(2, 2, 3)),
                1e-12)
                << name;
    }
}

TEST(MeshReaders, OnlyFilesWithFacesAreMeshes) {
    const TempFolder folder;
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n";
    EXPECT_FALSE(io::is_mesh(folder.write("points.ply", head + "end_header\n0\n")));
    EXPECT_FALSE(io::is_mesh(folder.write(
        "no_faces.ply", head + "element face 0\nproperty list uchar int vertex_indices\nend_header\n0\n")));
    EXPECT_FALSE(io::is_mesh(folder.write("text.ply", "hello\n")));
    EXPECT_FALSE(io::is_mesh(folder / "absent.obj"));
    EXPECT_FALSE(io::is_mesh(folder / "absent.ply"));
}

TEST(MeshReaders, ObjCountsForwardsAndBackwards) {
    const TempFolder folder;
    const std::string four = "v 0 0 0\r\nv 1 0 0\r\n\tv 0 1 0 1\r\nv 9 9 9 0.5 0.5 0.5\r\n";
    const Corners wanted = {{glm::dvec3(0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)}};
    EXPECT_EQ(read_obj(folder, four + "f 1 2/7 3//2"), wanted);
    EXPECT_EQ(read_obj(folder, four + "f -4 -3/1/1 -2\nv 7 7 7\n"), wanted);
    EXPECT_EQ(read_obj(folder, four + "f 1 \\\n2 \\\n3\nf 1 2\n# f 1 2 4\n"), wanted);
}

TEST(MeshReaders, ErrorsNameTheByte) {
    const TempFolder folder;
    const auto fails = [&](const std::string& text, const std::string& part) {
        expect_error<InputError>([&] { read_obj(folder, text); }, {"a.obj: byte ", part});
    };
    fails("v 0 0\nf 1 1 1\n", "three numbers");
    fails("v 0 0 one\n", "\"one\"");
    fails("v 0 0 0\nf 1 1 2\n", "the corner \"1\" (from 0), but there are 1 vertices");
    fails("v 0 0 0\nf 1 1 -2\n", "\"-1\"");
    fails("v 0 0 0\nf 1 1 0\n", "the corner \"0\"");
    fails("v 0 0 0\nf 1 1 x\n", "the corner \"x\"");
    fails("v 0 0 0\nf 1 1\n", "no face of three corners");
    fails("v 0 0 nan\nf 1 1 1\n", "corners that are all finite");
    fails("", "no face");
    fails("v 0 0 0\nf" + std::string(1100000, ' ') + "1", "longer than");
    // 20 MiB of triangles from a short line.
    std::string many = "v 0 0 0\nf";
    for (int i = 0; i < 300000; ++i) many += " 1";
    fails(many, "times the file");

    const std::string head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n";
    const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const auto ply_fails = [&](const std::string& text, const std::string& part) {
        const auto path = folder.write("a.ply", text);
        expect_error<InputError>([&] { io::read_ply_mesh(path); }, {"a.ply: byte ", part});
    };
    ply_fails(head + faces + "0 0\n0 0\n0 0\n3 0 1 2\n", "\"z\"");
    const std::string rows = "0 0 0\n0 1 0\n0 0 1\n";
    ply_fails(head + "property float z\n" + faces + rows + "3 0 1 3\n", "\"3\"");
    ply_fails(head + "property float z\n" + faces + rows + "3 0 1 1.5\n", "\"1.5\"");
    ply_fails(head + "property float z\n" + faces + rows + "200 0 1 2\n", "values of \"vertex_indices\"");
    ply_fails(head + "property float z\nend_header\n" + rows, "\"face\"");
}

TEST(MeshReaders, EveryCutIsReadOrRefused) {
    const TempFolder folder;
    for (const char* name : {"read_ply_mesh/quads.ply", "read_ply_mesh/big.ply", "read_obj_mesh/cube.obj"}) {
        const std::string bytes = test::file_bytes(kSeeds / name);
        const auto path = folder.write(std::filesystem::path(name).filename().string(), bytes);
        test::read_every_cut(path, bytes, [&] { io::read_mesh(path); });
    }
}

}  // namespace
