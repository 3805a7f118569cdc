// SPDX-License-Identifier: Apache-2.0
// Edits with undo and redo. A step keeps what has changed of the states, compressed, and no splat.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "edit/edited_splats.h"
#include "edit/edits.h"

namespace ewa::edit {

/// An edit as a user types it: --name value.
struct Words {
    std::string name, value;  // value: empty if the edit has none
    bool operator==(const Words&) const = default;
};

/// Edits that are done and undone together.
struct Step {
    std::string title;  // for people, such as "Delete"
    std::vector<Words> edits;
    bool operator==(const Step&) const = default;
};

/// The edits of the steps, in order.
std::vector<Words> edits_of(std::span<const Step> steps);

/// The edits up to the last one that does more than select. Two states with the same lasting edits need no save between them.
std::vector<Words> lasting_edits(std::span<const Step> steps);

class History {
  public:
    explicit History(std::shared_ptr<const Gaussians> splats, Cameras cameras = {});

    /// Performs a step, and drops the steps that were undone. Throws InputError, and changes nothing, for an edit that cannot be
    /// read or done. Only edits of a selection are allowed. Returns whether any splat has changed. steps().back() is then the step, with
    /// splats= in place of `contradicted`.
    bool perform(const Step& step);
    bool undo();  // false: there is nothing to undo
    bool redo();

    const EditedSplats& splats() const { return splats_; }
    const std::shared_ptr<const Gaussians>& first() const { return splats_.first(); }  // without any edit
    const std::vector<Step>& steps() const { return steps_; }                          // the undone ones too
    size_t done() const { return done_; }  // steps that are in effect
    std::span<const Step> in_effect() const { return {steps_.data(), done_}; }
    std::vector<Words> edits() const { return edits_of(in_effect()); }
    /// Rises with every change. The number of values changes only if splats() has others.
    uint64_t version() const { return version_; }
    uint64_t values_version() const { return values_version_; }
    uint64_t bytes() const;  // host memory of the history and the states, without splats

  private:
    struct Before {
        EditedSplats::Extent extent;
        std::vector<uint8_t> changed;  // zlib: the bits of states that the step has changed
        bool values;
    };
    void flip(const Before& before, size_t splats);  // splats: as many as there were after the step

    EditedSplats splats_;
    std::vector<Step> steps_;
    std::vector<Before> before_;  // of the steps, as far as they were done
    size_t done_ = 0;
    uint64_t version_ = 1, values_version_ = 1;
};

/// The edits without the selections that a later one replaces before anything else is done. The result is the same.
std::vector<Words> needed_edits(const std::vector<Words>& edits);

/// The line that does the same to other files: "ewa convert IN OUT --select ... --delete". Words are quoted for a POSIX shell.
std::string command_line(const std::vector<Words>& edits, const std::string& input,
                         const std::string& output);

}  // namespace ewa::edit
