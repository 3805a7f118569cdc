// SPDX-License-Identifier: Apache-2.0
// Splats with a state each. Edits of a selection change states and values, and never move a splat to another index.
#pragma once
#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "edit/filters.h"
#include "ewa/gaussians.h"

namespace ewa::edit {

/// Bits of a splat's state. Renderer::mark takes the same bits.
enum State : uint8_t {
    kSelected = 1,
    kLocked = 2,   // drawn, but neither selected nor changed
    kHidden = 4,   // not drawn, neither selected nor changed
    kDeleted = 8,  // not drawn, not written
};

/// A change of colours: of SH coefficients, in the order of the members.
struct Adjustment {
    std::array<float, 3> tint{1, 1, 1};  // factor of each channel
    float brightness = 0;                // added to every channel
    float contrast = 1;                  // factor about the middle grey, 0.5
    float white = 1;                     // the value that becomes 1
    float opacity = 1;                   // factor of the opacity
    bool operator==(const Adjustment&) const = default;
};

/// Back to the values that the splats had at first.
struct Reset {
    bool operator==(const Reset&) const = default;
};

/// An edit of values: an affine transform in the world, a change of colours, or a reset.
using ValueEdit = std::variant<glm::dmat4, Adjustment, Reset>;

/// The splats whose state is not kDeleted, in order. states: one for each splat.
Gaussians splats_left(const Gaussians& gaussians, const std::vector<uint8_t>& states);

class EditedSplats {
  public:
    /// cameras: of the run that trained the splats; for the filter `views`.
    explicit EditedSplats(std::shared_ptr<const Gaussians> splats, Cameras cameras = {});

    size_t size() const { return states_.size(); }  // deleted ones included
    /// Size() splats, deleted ones included. A copy of the first splats exists only while values differ.
    const std::shared_ptr<const Gaussians>& splats() const { return now_; }
    const std::shared_ptr<const Gaussians>& first() const { return first_; }  // without any edit
    const std::vector<uint8_t>& states() const { return states_; }
    /// Empty once splats have moved.
    Cameras cameras() const;
    /// The splats that are not deleted, in order.
    Gaussians result() const { return splats_left(*now_, states_); }

    bool selectable(size_t i) const { return (states_[i] & (kLocked | kHidden | kDeleted)) == 0; }
    /// Whether an edit of the selection changes splat i.
    bool affected(size_t i) const { return selectable(i) && (states_[i] & kSelected) != 0; }
    size_t count(uint8_t bits) const;  // splats that are not deleted, with any of these bits
    size_t left() const;               // splats that are not deleted

    /// Sets the states of all splats. Requires size() of them.
    void set_states(std::vector<uint8_t> states);
    /// Changes the values of the affected splats, or of all. Throws InputError, and changes nothing, for a transform that is no affine
    /// one, and where values leave the range of float32.
    void change(const ValueEdit& edit, bool all = false);
    /// Appends a copy of each affected splat, and selects the copies in place of the originals.
    void duplicate();

    // What undo needs.
    struct Extent {
        size_t splats, groups;
    };
    Extent extent() const { return {size(), groups_.size()}; }
    /// Goes back to an earlier extent, with the values of that time. The states of the splats that remain stay.
    void rewind(const Extent& extent);
    uint64_t bytes() const;  // of states and groups; splats() are not counted

  private:
    /// Splats that were changed by the same edits: those of the parent, then this one. Group 0 has the first values, and no entry.
    struct Group {
        uint32_t parent;
        ValueEdit edit;
        glm::dvec3 origin;  // of the splats after the edit
    };
    std::vector<uint32_t> affected_splats(bool all = false) const;
    const glm::dvec3& origin_of(uint32_t group) const;
    Gaussians first_values(std::vector<uint32_t> indices) const;
    Gaussians values_of(uint32_t group, const std::vector<uint32_t>& indices) const;
    void set_values(const std::vector<uint32_t>& indices, Gaussians values);
    Gaussians& writable();
    void take_back(size_t groups);  // groups: that remain

    std::shared_ptr<const Gaussians> first_, now_;
    std::shared_ptr<Gaussians> own_;  // now_, once values have changed
    Cameras cameras_;
    std::vector<uint8_t> states_;
    std::vector<uint32_t> sources_;   // of the splats behind those of first_: where they are in it
    std::vector<uint32_t> group_of_;  // of each splat; empty: all in group 0
    std::vector<Group> groups_;       // 1, 2, ...
};

/// Changes the colours and opacities of splats.
void adjust_splats(Gaussians& gaussians, const Adjustment& adjustment);

}  // namespace ewa::edit
