// SPDX-License-Identifier: Apache-2.0
// Selections with numbers that no tool writes, of splats that no training makes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/live_edit.h"
#include "edit/edits.h"
#include "edit/shapes.h"
#include "ewa/error.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

/// Splats in a row, one of each value that is not finite or huge, and two that touch.
Gaussians odd_splats() {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                    kInf = std::numeric_limits<float>::infinity();
    Gaussians g;
    g.resize(9);
    for (size_t i = 0; i < g.size(); ++i) {
        g.means[3 * i] = 0.1f * float(i);
        g.quaternions[4 * i] = 1;
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = -2;
    }
    g.means[0] = kNan;
    g.means[3] = -kInf;
    g.means[6] = 3e38f;
    g.log_scales[9] = 3e38f;
    g.log_scales[12] = -kInf;
    g.opacity_logits[5] = kNan;
    g.sh[18] = kNan;
    return g;
}

/// The text with its number `k` (counted from 0) replaced; empty if it has fewer.
std::string with_number(const std::string& text, size_t k, const std::string& number) {
    size_t begin = text.find('=') + 1;
    for (;; --k) {
        begin = text.find_first_of("-0123456789", begin);
        if (begin == std::string::npos) return {};
        const size_t end =
            std::min({text.find_first_not_of("-0123456789.", begin), text.find("..", begin), text.size()});
        if (k == 0) return text.substr(0, begin) + number + text.substr(end);
        begin = end;
    }
}

/// Whether --select takes the text. Otherwise its error is one short line that names the option.
bool selects(const std::string& shape) {
    const auto splats = std::make_shared<const Gaussians>(odd_splats());
    try {
        edit::EditedSplats edited(splats);
        edit::perform_on(edited, edit::parse("select", shape));
        EXPECT_EQ(edited.states().size(), splats->size());
        return true;
    } catch (const InputError& error) {
        const std::string line = error.what();
        EXPECT_TRUE(line.starts_with("--select: '")) << line;
        EXPECT_TRUE(line.find('\n') == std::string::npos && line.size() < 500) << line;
        return false;
    }
}

TEST(HostileSelection, OfAnyNumberSelectsOrIsRefused) {
    const std::string view = ";view=100,100,50,50,1,0,0,0,0,0,5",
                      rays = ";view=parallel:9,9,5,5,1,0,0,0,0,0,5";
    const std::string shapes[] = {"flood=0,0,0,1",
                                  "flood=0.6,0,0,1",
                                  "flood=0.6,0,0,1,0.5",
                                  "color=0.5,0.5,0.5,1",
                                  "cluster=0,0,0",
                                  "grow=1",
                                  "shrink=1",
                                  "box=-1,-1,-1,1,1,1",
                                  "sphere=0,0,0,1",
                                  "x=0..1",
                                  "scale=0..1",
                                  "polygon=0,0,90,0,90,90" + view + ";front",
                                  "polygon=0,0,90,0,90,90" + view + ";extent",
                                  "brush=9,50,50,60,60" + view + ";front;extent",
                                  "brush=9,50,50" + rays + ";extent;front"};
    for (const std::string& shape : shapes) {
        SCOPED_TRACE(shape);
        EXPECT_TRUE(selects(shape));
        for (const char* number :
             {"0", "-1", "nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "1e9", "1e999", ""})
            for (size_t k = 0; !with_number(shape, k, "1").empty(); ++k)
                selects(with_number(shape, k, number));
    }
}

TEST(HostileSelection, IsRefusedWithWhatIsExpected) {
    const std::string view = ";view=1,1,0,0,1,0,0,0,0,0,0";
    const std::string longest = "polygon=" + std::string(200'000, '7') + view;
    for (const auto& [shape, part] : std::vector<std::pair<std::string, std::string>>{
             {"flood=0,0,0,-1", "flood=x,y,z,T with a tolerance T of 0 or more"},
             {"flood=0,0,0,1,2", "flood=x,y,z,T,o with a least opacity o from 0 to 1"},
             {"flood=0,0,0,1,-0.1", "flood=x,y,z,T,o with a least opacity o from 0 to 1"},
             {"flood=0,0,0,1,0.1,3", "flood=x,y,z,T,o with a least opacity o from 0 to 1"},
             {"color=0,0,0,1,0.1", "color=r,g,b,T with a tolerance T of 0 or more"},
             {"color=0,0,0,-1", "color=r,g,b,T with a tolerance T of 0 or more"},
             {"polygon=-1e308,-1e308,1e308,0,0,1e308" + view + ";front", "in px up to 1e9"},
             {"polygon=0,0,1,1" + view, "three points or more"},
             {"brush=1e308,0,0" + view + ";front", "in px up to 1e9"},
             {"brush=0,0,0" + view, "a radius R above 0"},
             {"brush=1,0,0;view=0,1,0,0,1,0,0,0,0,0,0", "neither a focal length"},
             {"brush=1,0,0;view=1,1,0,0,0,0,0,0,0,0,0", "the quaternion"},
             {"brush=1,0,0;view=1,1,0,0,1e300,0,0,0,0,0,0", "the quaternion"},
             {"brush=1,0,0", ";view=VIEW behind its points"},
             {"brush=1,0,0" + view + ";behind", "'behind' is not"},
             {"grow=0", "a distance above 0"},
             {longest, "7777...' is not polygon"}}) {
        SCOPED_TRACE(shape.substr(0, 200));
        EXPECT_FALSE(selects(shape));
        expect_error<InputError>([&] { edit::parse("select", shape); }, {part});
        const std::string body = R"({"edits": [["select", ")" + shape + R"("], ["delete"]]})";
        expect_error<InputError>([&] { cli::live_edit(odd_splats(), {}, body); }, {part});
    }
}

TEST(HostileSelection, OfANanColourTakesNothing) {
    edit::EditedSplats edited(std::make_shared<const Gaussians>(odd_splats()));
    edit::perform_on(edited, edit::parse("select", "flood=0.6,0,0,1"));  // the splat there has no colour
    EXPECT_EQ(edited.count(edit::kSelected), 0u);
    edit::perform_on(edited, edit::parse("select", "flood=0.8,0,0,1"));
    EXPECT_GE(edited.count(edit::kSelected), 2u);
}

TEST(HostileTransform, NamesTheOption) {
    for (const char* step : {"scale=0", "scale=1e300", "turn=0,0,0,90", "turn=1e-300,0,0,45",
                             "turn=1e300,0,0,45", "1,0,0,0,0,1,0,0,0,0,0,0", "move=inf,0,0"}) {
        SCOPED_TRACE(step);
        Gaussians splats = odd_splats();
        expect_error<InputError>(
            [&] {
                const edit::Edit edits[] = {edit::parse("transform", step)};
                edit::apply(splats, edits);
            },
            {"--transform: "});
    }
}

TEST(HostileAdjustment, LeavesWhatIsNoNumber) {
    edit::EditedSplats edited(std::make_shared<const Gaussians>(odd_splats()));
    edit::perform_on(edited, edit::parse("select", "all"));
    edit::perform_on(edited, edit::parse("adjust", "tint=1.5,1,1;opacity=0.5"));
    EXPECT_TRUE(std::isnan(edited.splats()->opacity_logits[5]));
    EXPECT_NEAR(edited.splats()->opacity_logits[6], std::log(0.25 / 0.75), 1e-6);
    EXPECT_TRUE(std::isnan(edited.splats()->sh[18]));
}

TEST(HostileAdjustment, IsRefusedBeforeItChangesAnything) {
    for (const char* value : {"white=1e-60", "opacity=1e-60", "contrast=1e-9", "white=1001", "tint=1e300,1,1",
                              "tint=-1,1,1", "opacity=inf", "brightness=nan", "contrast="}) {
        SCOPED_TRACE(value);
        expect_error<InputError>([&] { edit::parse("adjust", value); },
                                 {"--adjust: '", value, "factors from 0.000001 to 1000"});
    }
    Gaussians bright = odd_splats();
    bright.sh[24] = 3e38f;
    edit::EditedSplats edited(std::make_shared<const Gaussians>(bright));
    edit::perform_on(edited, edit::parse("select", "all"));
    const edit::Edit doubled = edit::parse("adjust", "tint=2,2,2");
    expect_error<InputError>([&] { edit::perform_on(edited, doubled); }, {"--adjust: 1 of ", "float32"});
    EXPECT_EQ(edited.splats(), edited.first());
    edit::perform_on(edited, edit::parse("select", "x=0.75..1"));
    expect_error<InputError>([&] { edit::perform_on(edited, doubled); }, {"--adjust: 1 of 1 splats"});
    edit::perform_on(edited, edit::parse("select", "x=0.65..0.75"));
    for (int i = 0; i < 100; ++i) edit::perform_on(edited, doubled);
    EXPECT_TRUE(std::isfinite(edited.splats()->sh[21]));
}

}  // namespace
}  // namespace ewa::test
