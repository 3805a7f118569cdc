// SPDX-License-Identifier: Apache-2.0
#include "core/output.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "core/atomic_file.h"
#include "ewa/error.h"

namespace ewa::core {

void make_folder(const std::filesystem::path& folder) {
    if (folder.empty()) return;
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error && !std::filesystem::is_directory(folder, error))
        error = std::make_error_code(std::errc::not_a_directory);
    if (error) throw RunError("cannot make the folder " + folder.string() + ": " + error.message());
}

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
    make_folder(path.parent_path());
    write_text_file(path, json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace ewa::core
