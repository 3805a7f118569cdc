// SPDX-License-Identifier: Apache-2.0
#include "core/hash.h"

#include <algorithm>
#include <cstdio>

#include "core/file_reader.h"

namespace ewa::core {

void add_file(Hash& hash, const std::filesystem::path& path) {
    FileReader file(path);
    hash.add(file.size());
    const size_t head = size_t(std::min<uint64_t>(file.size(), 1u << 16));
    hash.add(file.take(head, "the file's beginning"), head);
}

std::string digits_of(const Hash& hash) {
    char text[17];
    std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash.value()));
    return text;
}

}  // namespace ewa::core
