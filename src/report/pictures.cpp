// SPDX-License-Identifier: Apache-2.0
#include "report/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "image/image_files.h"
#include "platform/file_facts.h"

namespace ewa::report {
namespace {

namespace fs = std::filesystem;

/// The parts of a name without root, "." and "..", so that the path stays inside the output folder. Models
/// written on Windows separate with backslashes.
std::vector<std::string> inner_parts(std::string name) {
    std::replace(name.begin(), name.end(), '\\', '/');
    std::vector<std::string> parts;
    for (const fs::path& part : fs::path(name).relative_path().lexically_normal())
        if (part != ".." && part != "." && !part.empty()) parts.push_back(part.string());
    if (parts.empty()) parts.push_back("frame");
    return parts;
}

/// The number of leading folders that all names share.
size_t shared_folders(const std::vector<std::vector<std::string>>& names) {
    if (names.empty()) return 0;
    size_t shared = names.front().size() - 1;
    for (const auto& parts : names) {
        size_t same = 0;
        while (same < std::min(shared, parts.size() - 1) && parts[same] == names.front()[same]) ++same;
        shared = same;
    }
    return shared;
}

/// Dark violet over orange to pale yellow, with even lightness: five samples of matplotlib's inferno.
std::array<float, 3> heat(double t) {
    static constexpr double kHeat[5][3] = {{0.001, 0.000, 0.014},
                                           {0.342, 0.062, 0.429},
                                           {0.736, 0.216, 0.330},
                                           {0.978, 0.557, 0.035},
                                           {0.988, 0.998, 0.645}};
    const double at = std::clamp(t, 0.0, 1.0) * 4;
    const int i = std::min(3, static_cast<int>(at));
    const double f = at - i;
    std::array<float, 3> color;
    for (int c = 0; c < 3; ++c) color[c] = float(kHeat[i][c] * (1 - f) + kHeat[i + 1][c] * f);
    return color;
}

/// The error of each pixel as a colour; NaN is brightest.
template <class Error>
Image heat_map(const Image& a, const Image& b, double full_scale, const Error& error_at) {
    if (a.width != b.width || a.height != b.height || a.channels < 3 || b.channels < 3)
        throw std::logic_error("error_map: images of different sizes");
    Image map(a.width, a.height, 3);
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x) {
            const double error = error_at(x, y);
            const auto color = heat(error <= full_scale ? error / full_scale : 1);
            std::copy(color.begin(), color.end(), map.at(x, y));
        }
    return map;
}

}  // namespace

std::vector<fs::path> picture_names(const std::vector<Frame>& frames) {
    std::vector<std::vector<std::string>> parts;
    for (const Frame& frame : frames) parts.push_back(inner_parts(frame.name));
    const size_t shared = shared_folders(parts);

    std::vector<fs::path> folders, files;
    std::map<fs::path, int> uses;
    for (const auto& name : parts) {
        fs::path folder;
        for (size_t i = shared; i + 1 < name.size(); ++i) folder /= name[i];
        folders.push_back(folder);
        files.push_back(name.back());
        ++uses[platform::folded(folder / files.back().stem())];
    }

    std::vector<fs::path> names;
    std::set<fs::path> taken;
    for (size_t i = 0; i < frames.size(); ++i) {
        fs::path name = folders[i] / files[i].stem();
        if (uses[platform::folded(name)] > 1) name = folders[i] / files[i];
        fs::path unique = name;
        for (int n = 2; !taken.insert(platform::folded(unique)).second; ++n)
            unique = name.string() + "-" + std::to_string(n);
        names.emplace_back(unique.generic_string());
    }
    return names;
}

Image error_map(const Image& a, const Image& b, double full_scale) {
    return heat_map(a, b, full_scale, [&](int x, int y) {
        double error = 0;
        for (int c = 0; c < 3; ++c)
            error +=
                std::abs(std::clamp(a.at(x, y)[c], 0.0f, 1.0f) - std::clamp(b.at(x, y)[c], 0.0f, 1.0f)) / 3.0;
        return error;
    });
}

Image value_error_map(const Image& a, const Image& b, double full_scale) {
    const auto value = [](const Image& image, int x, int y, int c) {
        return c < image.channels ? image.at(x, y)[c] : 1.0f;
    };
    return heat_map(a, b, full_scale, [&](int x, int y) {
        double error = 0;
        for (int c = 0; c < std::max(a.channels, b.channels); ++c) {
            const float va = value(a, x, y, c), vb = value(b, x, y, c);
            if (va == vb || (std::isnan(va) && std::isnan(vb))) continue;
            const double one = std::abs(double(va) - double(vb));
            if (!(one <= error)) error = one;
            if (std::isnan(error)) break;
        }
        return error;
    });
}

}  // namespace ewa::report
