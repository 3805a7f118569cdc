// SPDX-License-Identifier: Apache-2.0
// The options of a run under the names that earlier versions of ewa gave them.
#pragma once

namespace ewa::folders {

/// The options with their present names. A former flag becomes the value that it meant, which replaces a value under the present
/// name. Returns JSON that is no object unchanged.
template <class Json>
Json with_present_names(Json options) {
    struct Former {
        const char *flag, *name, *value;
    };
    for (const auto& [flag, name, value] :
         {Former{"exposure", "appearance", "affine"}, Former{"antialias", "kernel", "antialias"}}) {
        const auto found = options.is_object() ? options.find(flag) : options.end();
        if (found == options.end() || !found->is_boolean()) continue;
        const bool given = *found == true;
        options.erase(found);
        if (given) options[name] = value;
    }
    return options;
}

}  // namespace ewa::folders
