// SPDX-License-Identifier: Apache-2.0
#include "report/views.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>

#include "core/html.h"
#include "core/typing.h"
#include "image/image_files.h"
#include "report/chart.h"
#include "report/pictures.h"

namespace ewa::report {
namespace {

// The error (of 1) that is shown brightest. Larger errors are obvious to the eye.
constexpr double kErrorFullScale = 0.25;
// Three small pictures share a third of the page on a display with two pixels per point.
constexpr int kSmallSide = 320, kLargestSide = 4096;
constexpr int kSmallQuality = 80, kFullQuality = 92;

ReportView::Jpeg jpeg(const Image& image, int factor, int quality) {
    return image::encode_jpeg(factor > 1 ? downscale(image, factor) : image, quality);
}

/// By which a small picture is smaller.
int small_factor(const Image& image) {
    return std::max(1, int(std::lround(double(std::max(image.width, image.height)) / kSmallSide)));
}

std::string picture(const ReportView::Jpeg& bytes, const char* alt) {
    return fmt::format("<img class=\"{0}\" alt=\"{0}\" src=\"data:image/jpeg;base64,{1}\">", alt,
                       core::base64(bytes));
}

std::string figures(const ReportView& view) {
    return fmt::format("{}, SSIM {:.4f}", decibels(view.psnr), view.ssim);
}

std::string card(const ReportView& view, size_t number, bool small_pictures) {
    std::string pictures;
    if (small_pictures)
        pictures = picture(view.small_photo, "image") + picture(view.small_rendering, "render") +
                   picture(view.small_error, "error");
    if (!view.photo.empty())
        pictures = fmt::format("<a href=\"#full-{}\" title=\"compare at full size\">{}</a>", number,
                               pictures.empty() ? "compare at full size" : pictures);
    else if (!pictures.empty())
        pictures = "<div>" + pictures + "</div>";
    return fmt::format(
        "<figure class=\"view\" id=\"view-{}\">{}<figcaption><b>{}</b> "
        "<span>{}</span></figcaption></figure>\n",
        number, pictures, escape_html(view.name), figures(view));
}

/// A view over the whole window. Its address opens it, so that it needs no script.
std::string full_size(const ReportView& view, size_t number, size_t worse, size_t better) {
    const auto link = [](size_t to, const char* text) {
        return to > 0 ? fmt::format("<a href=\"#full-{}\">{}</a>", to, text) : std::string();
    };
    return fmt::format(
               "<section class=\"full\" id=\"full-{}\" aria-label=\"{} at full size\"><nav><p><b>{}</b> "
               "<span>{}, {} × {} px</span></p><p>{}{}<label><input type=\"checkbox\" class=\"actual\">"
               "actual pixels</label><label><input type=\"checkbox\" class=\"differ\">difference × 4</label>"
               "<a href=\"#view-{}\" class=\"close\">close</a></p></nav>\n",
               number, escape_html(view.name), escape_html(view.name), figures(view), view.width, view.height,
               link(worse, "worse"), link(better, "better"), number) +
           fmt::format("<div class=\"pair\" style=\"--ratio:{:.4f};--width:{}px\">{}{}<i></i>",
                       double(view.width) / std::max(1, view.height), view.width,
                       picture(view.photo, "image"), picture(view.rendering, "render")) +
           "<span>image</span><span>render</span><input type=\"range\" min=\"0\" max=\"100\" "
           "value=\"50\" step=\"0.5\" aria-label=\"image on the left, render on the right\"></div>"
           "</section>\n";
}

/// The number of views, from the first, whose small pictures fit in the report.
size_t with_small_pictures(const std::vector<ReportView>& views) {
    size_t bytes = 0, count = 0;
    for (const ReportView& view : views) {
        bytes += view.small_photo.size() + view.small_rendering.size() + view.small_error.size();
        if (bytes > kSmallBytes) break;
        ++count;
    }
    return count;
}

std::string explanation(const std::vector<ReportView>& views, size_t small, size_t full) {
    std::string text = core::counted(views.size(), "view") +
                       ", sorted by PSNR with the worst first: image, render and error (brightest from ";
    text += fmt::format("a difference of {:g}).", kErrorFullScale);
    if (full > 0) text += " A click on a picture compares image and render at full size.";
    std::string limits;
    if (full > 0 && full < views.size())
        limits += fmt::format(" Only {} of the {} views open at full size, spread from worst to best.", full,
                              views.size());
    if (small < views.size()) limits += fmt::format(" Only the worst {} have small pictures.", small);
    if (!limits.empty()) limits += " This bounds the size of the file.";
    return "<p class=\"soft\">" + text + limits + "</p>\n";
}

}  // namespace

std::string decibels(double psnr) {
    return std::isinf(psnr) ? "∞ dB" : fmt::format("{:.2f} dB", psnr);
}

ReportView small_view(const std::string& name, const Image& photo, const Image& rendering, double psnr,
                      double ssim) {
    const int factor = small_factor(photo);
    ReportView view{name, psnr, ssim, -1, photo.width, photo.height, {}, {}, {}, {}, {}};
    view.small_photo = jpeg(photo, factor, kSmallQuality);
    view.small_rendering = jpeg(rendering, factor, kSmallQuality);
    view.small_error = jpeg(error_map(rendering, photo, kErrorFullScale), factor, kSmallQuality);
    return view;
}

size_t add_full_size(ReportView& view, const Image& photo, const Image& rendering) {
    const int factor = (std::max(photo.width, photo.height) + kLargestSide - 1) / kLargestSide;
    view.photo = jpeg(photo, factor, kFullQuality);
    view.rendering = jpeg(rendering, factor, kFullQuality);
    return view.photo.size() + view.rendering.size();
}

void sort_views(std::vector<ReportView>& views) {
    std::stable_sort(views.begin(), views.end(),
                     [](const ReportView& a, const ReportView& b) { return a.psnr < b.psnr; });
}

std::vector<size_t> full_size_order(size_t count) {
    std::vector<size_t> order;
    std::set<size_t> taken;
    const auto take = [&](size_t i) {
        if (taken.insert(i).second) order.push_back(i);
    };
    for (size_t parts = 1; order.size() < count; parts *= 2)
        for (size_t k = 0; k <= parts; ++k) take(k * (count - 1) / parts);
    return order;
}

LeftOutView left_out_view(const std::string& name, const Image& image, const Image& mask, double share) {
    constexpr std::array<float, 3> kTint{1.0f, 0.0f, 0.6f};
    constexpr float kTinted = 0.6f;
    Image tinted = image;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            if (*mask.at(int(int64_t(x) * mask.width / image.width),
                         int(int64_t(y) * mask.height / image.height)) > 0.5f)
                continue;
            float* pixel = tinted.at(x, y);
            for (size_t c = 0; c < 3; ++c) pixel[c] += kTinted * (kTint[c] - pixel[c]);
        }
    return {name, share, jpeg(tinted, small_factor(image), kSmallQuality)};
}

std::string left_out_html(const std::vector<LeftOutView>& views) {
    if (views.empty()) return "";
    std::string html =
        "<h2>Masked by --robust</h2>\n<p class=\"soft\">What other images do not show there. "
        "Tinted pixels have no part in the training.</p>\n<div class=\"views\">\n";
    for (const LeftOutView& view : views)
        html += fmt::format(
            "<figure class=\"view\"><div>{}</div><figcaption><b>{}</b> <span>{:.1f} %</span></figcaption>"
            "</figure>\n",
            picture(view.picture, "image"), escape_html(view.name), 100 * view.share);
    return html + "</div>\n";
}

std::string views_html(const std::vector<ReportView>& views, bool held_out) {
    if (views.empty()) return "";
    std::vector<size_t> full;
    for (size_t i = 0; i < views.size(); ++i)
        if (!views[i].photo.empty()) full.push_back(i);
    const size_t small = with_small_pictures(views);
    std::string html = fmt::format("<h2>{} views</h2>\n", held_out ? "Held-out" : "Training") +
                       explanation(views, small, full.size()) + "<div class=\"views\">\n";
    for (size_t i = 0; i < views.size(); ++i) html += card(views[i], i + 1, i < small);
    html += "</div>\n";
    for (size_t k = 0; k < full.size(); ++k)
        html += full_size(views[full[k]], full[k] + 1, k > 0 ? full[k - 1] + 1 : 0,
                          k + 1 < full.size() ? full[k + 1] + 1 : 0);
    return html;
}

}  // namespace ewa::report
