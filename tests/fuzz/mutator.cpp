// SPDX-License-Identifier: Apache-2.0
// How libFuzzer changes an input: half of the changes are of structure, which changes of bytes hardly reach.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "structure.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t most);

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most, unsigned seed) {
    if (seed % 2 == 0) return LLVMFuzzerMutate(data, size, most);
    const std::string bytes(reinterpret_cast<const char*>(data), size);
    const std::string changed = ewa::fuzz::Structure(seed / 2).of(bytes, bytes);
    if (changed.empty() || changed.size() > most) return LLVMFuzzerMutate(data, size, most);
    std::memcpy(data, changed.data(), changed.size());
    return changed.size();
}
