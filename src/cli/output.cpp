#include "cli/output.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "core/atomic_file.h"
#include "ewa/error.h"

namespace ewa::cli {

void make_folder(const std::filesystem::path& folder) {
    if (folder.empty()) return;
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error && !std::filesystem::is_directory(folder, error))
        error = std::make_error_code(std::errc::not_a_directory);
    if (error) throw RunError("cannot make the folder " + folder.string() + ": " + error.message());
}

void write_json(const std::filesystem::path& path, const report::Json& json) {
    make_folder(path.parent_path());
    // Names and paths may hold bytes that are not UTF-8; those become U+FFFD.
    core::write_file_atomically(path,
                                json.dump(2, ' ', false, report::Json::error_handler_t::replace) + "\n");
}

std::string read_text(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file || std::filesystem::is_directory(path))
        throw InputError("cannot read " + path.string() + ": " + std::strerror(errno ? errno : EISDIR));
    return text;
}

}  // namespace ewa::cli
