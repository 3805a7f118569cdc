// SPDX-License-Identifier: Apache-2.0
#include "edit/edited_splats.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "edit/steps.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/splat_arrays.h"
#include "shared/constants.h"

namespace ewa::edit {
namespace {

/// Transforms splats. The means are relative to `origin` afterwards. Each splat gets the same values whatever others are with it.
void transform_about(Gaussians& splats, const glm::dmat4& matrix, const glm::dvec3& origin) {
    std::vector<float> means(3 * splats.size());
    for (size_t i = 0; i < splats.size(); ++i) {
        const glm::dvec3 to = glm::dvec3(matrix * glm::dvec4(splats.world_mean(i), 1)) - origin;
        for (int axis = 0; axis < 3; ++axis) means[3 * i + size_t(axis)] = float(to[axis]);
    }
    place_splats(splats, matrix, "--transform");
    splats.means = std::move(means);
    splats.origin = origin;
}

/// Rounds the means to float32 about another origin.
void move_origin(Gaussians& splats, const glm::dvec3& origin) {
    const glm::dvec3 apart = splats.origin - origin;
    if (apart == glm::dvec3(0)) return;
    for (size_t k = 0; k < splats.means.size(); ++k)
        splats.means[k] = float(splats.means[k] + apart[int(k % 3)]);
    splats.origin = origin;
}

/// A reset finds the first values in `splats`.
void apply_edit(Gaussians& splats, const ValueEdit& edit, const glm::dvec3& origin) {
    if (std::holds_alternative<Reset>(edit)) move_origin(splats, origin);
    if (const auto* matrix = std::get_if<glm::dmat4>(&edit)) transform_about(splats, *matrix, origin);
    if (const auto* adjustment = std::get_if<Adjustment>(&edit))
        change_splats(splats, "--adjust", [&](Gaussians& g) { adjust_splats(g, *adjustment); });
}

void scale_opacities(Gaussians& splats, double factor) {
    const bool density = splats.density;
    fit_opacities(splats, false);
    for (float& logit : splats.opacity_logits) {
        const double opacity = factor / (1 + std::exp(-double(logit)));
        if (std::isnan(opacity)) continue;
        logit = opacity < 1 ? std::min(float(std::log(opacity / (1 - opacity))), scene::kOpaqueLogit)
                            : scene::kOpaqueLogit;
    }
    fit_opacities(splats, density);
}

}  // namespace

void adjust_splats(Gaussians& gaussians, const Adjustment& a) {
    check(gaussians);
    constexpr double kMiddle = 0.5;
    const size_t stride = gaussians.sh_stride();
    for (size_t channel = 0; channel < 3; ++channel) {
        // out = factor * in + offset
        const double factor = double(a.tint[channel]) * a.contrast / a.white;
        const double offset = ((double(a.brightness) - kMiddle) * a.contrast + kMiddle) / a.white;
        if (factor == 1 && offset == 0) continue;
        for (size_t i = 0; i < gaussians.sh.size(); i += stride) {
            float& first = gaussians.sh[i + channel];
            const double color = shared::COLOR_OFFSET + shared::SH_C0 * first;
            first = float((factor * color + offset - shared::COLOR_OFFSET) / shared::SH_C0);
            for (size_t k = 3; k < stride; k += 3)
                gaussians.sh[i + k + channel] = float(factor * gaussians.sh[i + k + channel]);
        }
    }
    if (a.opacity != 1) scale_opacities(gaussians, double(a.opacity));
}

Gaussians splats_left(const Gaussians& gaussians, const std::vector<uint8_t>& states) {
    std::vector<uint32_t> left;
    for (size_t i = 0; i < states.size(); ++i)
        if ((states[i] & kDeleted) == 0) left.push_back(uint32_t(i));
    return left.size() == gaussians.size() ? gaussians : scene::rows_of(gaussians, left);
}

EditedSplats::EditedSplats(std::shared_ptr<const Gaussians> splats, Cameras cameras)
    : first_(std::move(splats)), now_(first_), cameras_(std::move(cameras)), states_(first_->size()) {}

Cameras EditedSplats::cameras() const {
    const auto moves = [](const Group& group) { return std::holds_alternative<glm::dmat4>(group.edit); };
    return std::ranges::any_of(groups_, moves) ? Cameras() : cameras_;
}

size_t EditedSplats::count(uint8_t bits) const {
    return size_t(std::ranges::count_if(
        states_, [&](uint8_t state) { return (state & kDeleted) == 0 && (state & bits) != 0; }));
}

size_t EditedSplats::left() const {
    return size_t(std::ranges::count_if(states_, [](uint8_t state) { return (state & kDeleted) == 0; }));
}

void EditedSplats::set_states(std::vector<uint8_t> states) {
    if (states.size() != size())
        throw InputError("there are " + std::to_string(states.size()) + " states for " +
                         std::to_string(size()) + " splats");
    states_ = std::move(states);
}

std::vector<uint32_t> EditedSplats::affected_splats(bool all) const {
    std::vector<uint32_t> indices;
    for (size_t i = 0; i < size(); ++i)
        if (all || affected(i)) indices.push_back(uint32_t(i));
    return indices;
}

const glm::dvec3& EditedSplats::origin_of(uint32_t group) const {
    return group == 0 ? first_->origin : groups_[group - 1].origin;
}

/// The values that splats had at first.
Gaussians EditedSplats::first_values(std::vector<uint32_t> indices) const {
    for (uint32_t& i : indices)
        if (i >= first_->size()) i = sources_[i - first_->size()];
    return scene::rows_of(*first_, indices);
}

/// The values of splats that are all in one group.
Gaussians EditedSplats::values_of(uint32_t group, const std::vector<uint32_t>& indices) const {
    std::vector<uint32_t> chain;
    for (; group != 0; group = groups_[group - 1].parent) {
        chain.push_back(group);
        if (std::holds_alternative<Reset>(groups_[group - 1].edit)) break;
    }
    Gaussians values = first_values(indices);
    for (auto g = chain.rbegin(); g != chain.rend(); ++g)
        apply_edit(values, groups_[*g - 1].edit, groups_[*g - 1].origin);
    return values;
}

/// A copy, unless nobody else reads the splats.
Gaussians& EditedSplats::writable() {
    constexpr long kOwners = 2;  // own_ and now_
    if (!own_ || own_.use_count() > kOwners) own_ = std::make_shared<Gaussians>(*now_);
    now_ = own_;
    return *own_;
}

void EditedSplats::set_values(const std::vector<uint32_t>& indices, Gaussians values) {
    Gaussians& splats = writable();
    move_origin(values, splats.origin);
    for (size_t k = 0; k < indices.size(); ++k) scene::copy_splats(values, k, 1, splats, indices[k]);
}

void EditedSplats::change(const ValueEdit& edit, bool all) {
    const std::vector<uint32_t> indices = affected_splats(all);
    if (indices.empty()) return;
    glm::dvec3 origin = now_->origin;
    Gaussians values =
        std::holds_alternative<Reset>(edit) ? first_values(indices) : scene::rows_of(*now_, indices);
    // The origin changes only with all splats.
    if (const auto* matrix = std::get_if<glm::dmat4>(&edit); matrix && indices.size() == size()) {
        Gaussians moved = values;
        place_splats(moved, *matrix, "--transform");
        origin = moved.origin;
    }
    apply_edit(values, edit, origin);
    group_of_.resize(size());
    std::map<uint32_t, uint32_t> children;  // by the group that a splat was in
    for (const uint32_t i : indices) {
        const auto [child, fresh] = children.try_emplace(group_of_[i], uint32_t(groups_.size() + 1));
        if (fresh) groups_.push_back({group_of_[i], edit, origin});
        group_of_[i] = child->second;
    }
    writable().origin = origin;
    set_values(indices, std::move(values));
}

void EditedSplats::duplicate() {
    const std::vector<uint32_t> indices = affected_splats();
    if (indices.empty()) return;
    const Gaussians copies = scene::rows_of(*now_, indices);
    Gaussians& splats = writable();
    const size_t before = size();
    splats.resize(before + indices.size());
    scene::copy_splats(copies, 0, copies.size(), splats, before);
    if (!group_of_.empty()) group_of_.resize(splats.size());
    for (size_t k = 0; k < indices.size(); ++k) {
        const uint32_t i = indices[k];
        sources_.push_back(i < first_->size() ? i : sources_[i - first_->size()]);
        if (!group_of_.empty()) group_of_[before + k] = group_of_[i];
        states_.push_back(states_[i]);
        states_[i] &= uint8_t(~kSelected);
    }
}

void EditedSplats::rewind(const Extent& to) {
    if (to.splats < size()) {
        Gaussians& splats = writable();
        splats.resize(to.splats);
        states_.resize(to.splats);
        sources_.resize(to.splats - first_->size());
        if (!group_of_.empty()) group_of_.resize(to.splats);
    }
    if (to.groups < groups_.size()) take_back(to.groups);
    if (!groups_.empty() || size() > first_->size()) return;
    now_ = first_;
    own_.reset();
}

/// Removes the last groups, with the values that they gave.
void EditedSplats::take_back(size_t groups) {
    std::map<uint32_t, std::vector<uint32_t>> changed;  // by the group that they return to
    for (size_t i = 0; i < size(); ++i) {
        uint32_t group = group_of_[i];
        if (group <= groups) continue;
        while (group > groups) group = groups_[group - 1].parent;
        group_of_[i] = group;
        changed[group].push_back(uint32_t(i));
    }
    groups_.resize(groups);
    writable().origin = origin_of(uint32_t(groups));  // that of the last edit
    for (const auto& [group, indices] : changed) set_values(indices, values_of(group, indices));
    if (groups_.empty()) group_of_.clear();
}

uint64_t EditedSplats::bytes() const {
    return states_.capacity() + 4 * (sources_.capacity() + group_of_.capacity()) +
           groups_.capacity() * sizeof(Group);
}

}  // namespace ewa::edit
