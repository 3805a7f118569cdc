// SPDX-License-Identifier: Apache-2.0
#include "cli/live_edit.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/json_field.h"
#include "edit/edits.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

constexpr size_t kMostEditsOfBody = 1000;

/// The edits of [NAME, VALUE] pairs.
std::vector<edit::Edit> parsed_edits(const std::string& body) {
    const auto field = core::JsonField::of_text(body, "the edit");
    const auto pairs = field.items("edits");
    if (pairs.empty() || pairs.size() > kMostEditsOfBody)
        field.fail("\"edits\" needs 1 to " + std::to_string(kMostEditsOfBody) + " edits");
    std::vector<edit::Edit> edits;
    for (const core::JsonField& pair : pairs) {
        const nlohmann::json& texts = pair.list(nullptr);
        if (texts.size() != 2 || !texts[0].is_string() || !texts[1].is_string())
            pair.fail("is not a name and a value, which are texts");
        const auto& name = texts[0].get_ref<const std::string&>();
        edits.push_back(edit::parse(name, texts[1].get_ref<const std::string&>()));
        if (!edits.back().filter)
            throw InputError("--" + name +
                             " changes splats; a training that runs takes edits that remove splats");
    }
    return edits;
}

}  // namespace

SplatEdit live_edit(const Gaussians& splats, const std::string& body) {
    const std::vector<edit::Edit> edits = parsed_edits(body);
    Gaussians edited = splats;
    const edit::Applied applied = edit::apply(edited, edits);
    SplatEdit result;
    for (uint32_t i = 0; i < splats.size(); ++i)
        if (!std::ranges::binary_search(applied.left, i)) result.remove.push_back(i);
    return result;
}

}  // namespace ewa::cli
