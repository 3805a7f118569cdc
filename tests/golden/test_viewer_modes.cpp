// SPDX-License-Identifier: Apache-2.0
// What the window shows in each of its modes, drawn by its own thread on every device, against the float64
// CPU reference.
#include <algorithm>
#include <cmath>
#include <exception>

#include "golden/devices.h"
#include "golden/golden.h"
#include "reference/blend.h"
#include "reference/render.h"
#include "support/random_scene.h"
#include "support/soon.h"
#include "viewer/render_thread.h"

namespace ewa::test {
namespace {

using viewer::Mode;

struct ViewerCase {
    const char* name;
    viewer::Look look;
    // Half a step of 8 bits, where no threshold is near.
    Tolerance tolerance{0.013, 0.5 / 255 + 2e-5, 6};
};

void PrintTo(const ViewerCase& c, std::ostream* out) {
    *out << c.name;
}

Camera camera() {
    return random_camera(31, 48, 36);
}

/// Of degree 3, its colours inside what a window can show.
Gaussians splats() {
    Gaussians g = random_gaussians(32, 40, SplatKind::ordinary, camera(), 3);
    for (float& value : g.sh) value *= 0.35f;
    return g;
}

std::vector<ViewerCase> cases() {
    const auto look = [](Mode mode, int degree = 3, float scale = 1, Footprint kernel = Footprint::peak) {
        return viewer::Look{mode, {0.1f, 0.3f, 0.5f}, kernel, degree, scale};
    };
    // A count is a whole number: where a splat's reach ends the two may differ by one of some twenty.
    const Tolerance counted{0.35, 0.5 / 255 + 2e-5, 6};
    // An ellipsoid's border is a step.
    const Tolerance stepped{1, 0.5 / 255 + 2e-5, 6};
    return {{"viewer_color", look(Mode::color)},
            {"viewer_depth", look(Mode::depth), counted},
            {"viewer_opacity", look(Mode::opacity)},
            {"viewer_count", look(Mode::count), counted},
            {"viewer_ellipsoids", look(Mode::ellipsoids), stepped},
            {"viewer_degree_0", look(Mode::color, 0)},
            {"viewer_degree_1", look(Mode::color, 1)},
            {"viewer_degree_2", look(Mode::color, 2)},
            {"viewer_scale", look(Mode::color, 3, 0.4f)},
            {"viewer_antialias", look(Mode::color, 3, 1, Footprint::antialias)}};
}

/// The value that a share of them is not above, as a rank of the sorted ones.
double ranked(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values.empty() ? 0 : values[size_t(share * double(values.size() - 1))];
}

Image shown_by_twin(const viewer::Look& look) {
    const Camera seen = camera();
    Gaussians scaled = splats();
    for (float& value : scaled.log_scales) value += std::log(look.splat_scale);
    const auto expected = reference::render(scaled, seen, {look.background, look.kernel, look.sh_degree});
    const reference::Blended& blended = expected.blended;
    const auto solids = reference::ellipsoids(expected.projected, expected.instances, look.background);
    std::vector<double> depths, counts;
    for (size_t i = 0; i < blended.blended.size(); ++i) {
        if (1 - blended.transmittance.values[i] >= 0.5) depths.push_back(blended.depth.values[i]);
        if (blended.blended[i] > 0) counts.push_back(double(blended.blended[i]));
    }
    const double near = ranked(depths, 0.02), far = ranked(depths, 0.98), many = ranked(counts, 0.99);
    Image image(seen.width, seen.height, 3);
    for (size_t i = 0; i < image.pixels.size() / 3; ++i)
        for (size_t c = 0; c < 3; ++c) {
            double value =
                look.mode == Mode::ellipsoids ? solids.values[3 * i + c] : blended.color.values[3 * i + c];
            // A tenth for the nearest; nothing is nearer than the near plane, but for where there is nothing.
            if (look.mode == Mode::depth)
                value =
                    blended.depth.values[i] > 0
                        ? 0.1 + 0.9 * std::clamp((blended.depth.values[i] - near) / (far - near), 0.0, 1.0)
                        : 0;
            if (look.mode == Mode::opacity) value = 1 - blended.transmittance.values[i];
            // A third of the way for each of red, green, blue.
            if (look.mode == Mode::count) value = 3 * double(blended.blended[i]) / many - double(c);
            image.pixels[3 * i + c] = float(std::clamp(value, 0.0, 1.0));
        }
    return image;
}

Image shown_by(const std::shared_ptr<gpu::Device>& device, const viewer::Look& look) {
    viewer::RenderThread thread([device] { return device; }, [] {});
    thread.set_scene(std::make_shared<const Gaussians>(splats()));
    viewer::RenderRequest request;
    request.camera = camera();
    request.look = look;
    thread.ask(request);
    viewer::RenderThread::News news;
    soon([&] {
        news = thread.take_news();
        return news.picture || news.failure;
    });
    if (news.failure) std::rethrow_exception(news.failure);
    if (!news.picture) return Image(1, 1, 3);
    const viewer::ByteImage& picture = news.picture->picture;
    Image image(picture.width, picture.height, 3);
    for (size_t i = 0; i < image.pixels.size() / 3; ++i)
        for (size_t c = 0; c < 3; ++c) image.pixels[3 * i + c] = float(picture.rgba[4 * i + c]) / 255.0f;
    return image;
}

class GoldenViewerTest : public testing::TestWithParam<ViewerCase> {};

TEST_P(GoldenViewerTest, ReferenceIsTheTwins) {
    EXPECT_TRUE(is_reference(GetParam().name, shown_by_twin(GetParam().look)));
}

TEST_P(GoldenViewerTest, DevicesAgree) {
    ASSERT_FALSE(all_devices().empty());
    for (const auto& device : all_devices())
        EXPECT_TRUE(matches_golden(GetParam().name, shown_by(device, GetParam().look), GetParam().tolerance,
                                   device_info(*device).name));
}

INSTANTIATE_TEST_SUITE_P(Golden, GoldenViewerTest, testing::ValuesIn(cases()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace ewa::test
