// SPDX-License-Identifier: Apache-2.0
// Marks of splats: hidden splats against a scene without them, and the colours of the others.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_edit.h"
#include "gpu/reference_inputs.h"
#include "gpu/test_device.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

/// On a GPU, last digits may differ: its compiler may fuse a multiplication and an addition in one of two specialised pipelines. So
/// may up to 8 values with a contribution at a threshold.
void expect_same_values(const Image& actual, const Image& expected) {
    const bool exact = device()->info().type == "cpu";
    ASSERT_EQ(actual.pixels.size(), expected.pixels.size());
    size_t different = 0;
    for (size_t i = 0; i < actual.pixels.size(); ++i)
        different += !(std::abs(actual.pixels[i] - expected.pixels[i]) <= (exact ? 0 : 1e-5f));
    EXPECT_LE(different, exact ? 0u : 8u);
}

/// A scene, its marks, and the scene of the splats that these do not hide.
struct MarkedScene {
    Scene scene;
    std::vector<uint8_t> marks;
    Gaussians rest;
};

/// Two of five splats get one of these marks each.
MarkedScene marked_scene(uint64_t seed, uint8_t first, uint8_t second, bool points = false) {
    MarkedScene made{random_scene(seed, 503, SplatKind::mixed, 61, 47, 1), {}, {}};
    made.scene.options.points = points;
    made.rest = made.scene.gaussians;
    std::vector<uint32_t> kept;
    for (uint32_t i = 0; i < 503; ++i) {
        // Kinds of splats alternate by five, so that this goes by seven.
        made.marks.push_back(i % 7 == 1 ? first : i % 7 > 4 ? second : 0);
        if (made.marks.back() == 0) kept.push_back(i);
    }
    keep_splats(made.rest, kept);
    return made;
}

TEST(Marks, HiddenSplatsAreAsThoughTheyWereNotThere) {
    for (const bool points : {false, true})
        for (const Drawing drawing : {Drawing::color, Drawing::depth, Drawing::count, Drawing::ellipsoids}) {
            MarkedScene marked = marked_scene(8100, kMarkHidden, kMarkDeleted | kMarkSelected, points);
            const Scene& scene = marked.scene;
            // What is hidden is not counted as damaged.
            marked.scene.gaussians.means[3] = std::numeric_limits<float>::quiet_NaN();
            Renderer renderer(device(), scene.gaussians, scene.options);
            Renderer without(device(), marked.rest, scene.options);
            const DrawOptions options{.render = scene.options, .drawing = drawing};
            const Image whole = renderer.render(scene.camera, options).color;
            const uint32_t damaged = renderer.skipped_nonfinite();
            renderer.mark(marked.marks);
            const Rendering actual = renderer.render(scene.camera, options);
            const Rendering expected = without.render(scene.camera, options);
            expect_same_values(actual.color, expected.color);
            expect_same_values(actual.alpha, expected.alpha);
            expect_same_values(actual.depth, expected.depth);
            expect_same_values(actual.count, expected.count);
            EXPECT_NE(actual.color.pixels, whole.pixels);
            EXPECT_EQ(renderer.skipped_nonfinite(), without.skipped_nonfinite());
            EXPECT_LT(renderer.skipped_nonfinite(), damaged);
            EXPECT_EQ(renderer.splats_drawn(), without.splats_drawn());
            if (drawing == Drawing::depth || drawing == Drawing::count || drawing == Drawing::color)
                expect_same_values(renderer.render(scene.camera, drawing).color, expected.color);
        }
}

TEST(Marks, ThatChangeNothingLeaveTheBytes) {
    for (const bool points : {false, true}) {
        const MarkedScene marked = marked_scene(8200, kMarkHidden, kMarkSelected, points);
        const Scene& scene = marked.scene;
        Renderer renderer(device(), scene.gaussians, scene.options);
        const DrawOptions options{.render = scene.options};
        const std::vector<uint8_t> before = renderer.render_bytes(scene.camera, options);
        const auto expect_before = [&] { EXPECT_EQ(renderer.render_bytes(scene.camera, options), before); };
        renderer.mark(marked.marks);
        EXPECT_NE(renderer.render_bytes(scene.camera, options), before);
        renderer.mark({});
        expect_before();
        for (const uint8_t nothing : {uint8_t(0), uint8_t(128)}) {
            renderer.mark(std::vector<uint8_t>(503, nothing));
            expect_before();
        }
        renderer.mark(marked.marks);
        renderer.replace(scene.gaussians);
        expect_before();
    }
}

TEST(Marks, OfAnotherLengthAreRefused) {
    const MarkedScene marked = marked_scene(8300, kMarkHidden, kMarkSelected);
    const Scene& scene = marked.scene;
    Renderer renderer(device(), scene.gaussians, scene.options);
    renderer.mark(marked.marks);
    const Image before = renderer.render(scene.camera).color;
    EXPECT_THROW(renderer.mark(std::vector<uint8_t>(502)), InputError);
    EXPECT_THROW(renderer.mark(std::vector<uint8_t>(504)), InputError);
    EXPECT_EQ(renderer.render(scene.camera).color.pixels, before.pixels);
}

/// One splat in the middle of an image.
Scene isolated_splat() {
    Scene scene;
    scene.camera.width = 33;
    scene.camera.height = 25;
    scene.camera.fx = scene.camera.fy = 60;
    scene.camera.cx = 16.5;
    scene.camera.cy = 12.5;
    Gaussians& g = scene.gaussians;
    g.sh_degree = 0;
    g.resize(1);
    g.means = {0, 0, 4};
    g.quaternions = {1, 0, 0, 0};
    g.log_scales = {-1, -1, -1};
    g.opacity_logits = {6};
    g.sh = {0.8f, -0.4f, 1.2f};
    return scene;
}

/// The colour of an isolated splat, with a mark, is this in place of its own.
void expect_tint(uint8_t mark, const glm::dvec3& expected, bool points) {
    SCOPED_TRACE(int(mark));
    Scene scene = isolated_splat();
    scene.options.points = points;
    Renderer renderer(device(), scene.gaussians, scene.options);
    const Rendering plain = renderer.render(scene.camera);
    renderer.mark(std::vector<uint8_t>{mark});
    const Rendering marked = renderer.render(scene.camera);
    expect_same_values(marked.alpha, plain.alpha);
    size_t shown = 0;
    for (size_t i = 0; i < plain.alpha.pixels.size(); ++i) {
        shown += plain.alpha.pixels[i] > 0;
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(double(marked.color.pixels[3 * i + size_t(c)]),
                        expected[c] * double(plain.alpha.pixels[i]), 2e-6);
    }
    EXPECT_GT(shown, 20u);
    const DrawOptions no_tints{.render = scene.options, .plain_colors = true};
    expect_same_values(renderer.render(scene.camera, no_tints).color, plain.color);
}

TEST(Marks, TintAnIsolatedSplat) {
    const glm::dvec3 own = 0.5 + 0.28209479177387814 * glm::dvec3(0.8, -0.4, 1.2);
    const glm::dvec3 accent(1, 0.7, 0.1), red(1, 0, 0);
    for (const bool points : {false, true}) {
        expect_tint(0, own, points);
        expect_tint(kMarkSelected, glm::mix(own, accent, 0.65), points);
        expect_tint(kMarkLocked, 0.45 * own, points);
        expect_tint(kMarkPreview, glm::mix(own, red, 0.65), points);
        expect_tint(kMarkSelected | kMarkLocked, glm::mix(0.45 * own, accent, 0.65), points);
        expect_tint(kMarkSelected | kMarkPreview, glm::mix(glm::mix(own, accent, 0.65), red, 0.65), points);
    }
}

/// An opacity of 0.005, and one of 0.001, of which a plain image shows nothing.
TEST(Marks, OfAPreviewShowFaintSplats) {
    for (const float faint : {-5.3f, -6.9f}) {
        Scene scene = isolated_splat();
        scene.gaussians.opacity_logits = {faint};
        Renderer renderer(device(), scene.gaussians, scene.options);
        const Image plain = renderer.render(scene.camera).alpha;
        renderer.mark(std::vector<uint8_t>{kMarkSelected});
        expect_same_values(renderer.render(scene.camera).alpha, plain);
        renderer.mark(std::vector<uint8_t>{kMarkPreview});
        const DrawOptions no_tints{.render = scene.options, .plain_colors = true};
        expect_same_values(renderer.render(scene.camera, no_tints).alpha, plain);
        const Image shown = renderer.render(scene.camera).alpha;
        scene.gaussians.opacity_logits = {float(std::log(0.3 / 0.7))};
        const Image expected = Renderer(device(), scene.gaussians, scene.options).render(scene.camera).alpha;
        ASSERT_EQ(shown.pixels.size(), expected.pixels.size());
        for (size_t i = 0; i < shown.pixels.size(); ++i)
            ASSERT_NEAR(double(shown.pixels[i]), double(expected.pixels[i]), 1e-5);
        EXPECT_GT(*std::ranges::max_element(shown.pixels), 0.25f);
    }
}

TEST(Marks, WithPlainColoursHideAlone) {
    const MarkedScene marked = marked_scene(8500, kMarkHidden, kMarkDeleted);
    const Scene& scene = marked.scene;
    std::vector<uint8_t> marks = marked.marks;
    for (uint8_t& mark : marks) mark = mark == 0 ? uint8_t(kMarkPreview) : mark;
    Renderer renderer(device(), scene.gaussians, scene.options);
    Renderer without(device(), marked.rest, scene.options);
    renderer.mark(marks);
    const Image expected = without.render(scene.camera).color;
    const DrawOptions plain{.render = scene.options, .plain_colors = true};
    expect_same_values(renderer.render(scene.camera, plain).color, expected);
    EXPECT_NE(renderer.render(scene.camera, {.render = scene.options}).color.pixels, expected.pixels);
}

/// A surface is where the splats are that are not hidden. Tints do not change it.
TEST(Marks, SurfacesAreThoseOfTheOtherSplats) {
    const MarkedScene marked = marked_scene(8600, kMarkHidden, kMarkDeleted);
    const Scene& scene = marked.scene;
    std::vector<uint8_t> marks = marked.marks;
    for (uint8_t& mark : marks) mark |= kMarkSelected;
    Renderer renderer(device(), scene.gaussians, scene.options);
    Renderer without(device(), marked.rest, scene.options);
    const Image whole = renderer.render(scene.camera, Drawing::median_depth).median_depth;
    renderer.mark(marks);
    const Image depth = renderer.render(scene.camera, Drawing::median_depth).median_depth;
    EXPECT_NE(depth.pixels, whole.pixels);
    expect_same_values(depth, without.render(scene.camera, Drawing::median_depth).median_depth);
    expect_same_values(renderer.render(scene.camera, Drawing::normal).normal,
                       without.render(scene.camera, Drawing::normal).normal);
}

TEST(Marks, AreRefusedAlongRays) {
    Scene scene = isolated_splat();
    scene.options.integrator = Integrator::ray;
    Renderer renderer(device(), scene.gaussians, scene.options);
    const Image plain = renderer.render(scene.camera).color;
    for (const uint8_t mark : {kMarkHidden, kMarkSelected}) {
        renderer.mark(std::vector<uint8_t>{mark});
        EXPECT_THROW(renderer.render(scene.camera), InputError);
    }
    renderer.mark(std::vector<uint8_t>{128});
    EXPECT_EQ(renderer.render(scene.camera).color.pixels, plain.pixels);
}

}  // namespace
}  // namespace ewa::test
