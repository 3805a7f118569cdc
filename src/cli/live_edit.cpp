// SPDX-License-Identifier: Apache-2.0
#include "cli/live_edit.h"

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/json_field.h"
#include "edit/edited_splats.h"
#include "edit/edits.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

constexpr size_t kMostEditsOfBody = 1000;

struct NamedEdit {
    std::string name;
    edit::Edit edit;
};

/// The edits of [NAME, VALUE] pairs. An edit without a value may be [NAME].
std::vector<NamedEdit> parsed_edits(const std::string& body) {
    const auto field = core::JsonField::of_text(body, "the edit");
    const auto pairs = field.items("edits");
    if (pairs.empty() || pairs.size() > kMostEditsOfBody)
        field.fail("\"edits\" needs 1 to " + std::to_string(kMostEditsOfBody) + " edits");
    std::vector<NamedEdit> edits;
    for (const core::JsonField& pair : pairs) {
        const nlohmann::json& texts = pair.list(nullptr);
        if (texts.empty() || texts.size() > 2 || !texts.front().is_string() || !texts.back().is_string())
            pair.fail("is not a name and a value, which are texts");
        const auto& name = texts.front().get_ref<const std::string&>();
        edits.push_back(
            {name, edit::parse(name, texts.size() == 2 ? texts.back().get_ref<const std::string&>() : "")});
        if (!edits.back().edit.filter && !edit::changes_states(name))
            throw InputError("--" + name +
                             " changes splats; a training that runs takes edits that remove or lock splats");
    }
    return edits;
}

void remove_others(edit::EditedSplats& splats, const edit::Filter& filter) {
    const std::vector<bool> stay = filter(*splats.splats(), {});
    std::vector<uint8_t> states = splats.states();
    for (size_t i = 0; i < states.size(); ++i)
        if (!stay[i]) states[i] |= edit::kDeleted;
    splats.set_states(std::move(states));
}

}  // namespace

SplatEdit live_edit(const Gaussians& gaussians, const std::vector<bool>& frozen, const std::string& body) {
    edit::EditedSplats splats(std::make_shared<const Gaussians>(gaussians));
    std::vector<uint8_t> before(splats.size());
    for (size_t i = 0; i < frozen.size(); ++i) before[i] = frozen[i] ? edit::kLocked : 0;
    splats.set_states(before);
    for (const auto& [name, edit] : parsed_edits(body)) {
        if (edit.filter)
            remove_others(splats, edit.filter);
        else
            edit::perform_on(splats, edit);
    }
    SplatEdit result;
    for (uint32_t i = 0; i < splats.size(); ++i) {
        const uint8_t state = splats.states()[i];
        if ((state & edit::kDeleted) != 0)
            result.remove.push_back(i);
        else if (((state ^ before[i]) & edit::kLocked) != 0)
            (before[i] == 0 ? result.freeze : result.unfreeze).push_back(i);
    }
    return result;
}

}  // namespace ewa::cli
