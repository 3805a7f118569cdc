// SPDX-License-Identifier: Apache-2.0
// Any bytes as a trainer's answer: the first says which. What is taken comes back the same from the bytes
// that it is written as.
#include "ewa/error.h"
#include "input.h"
#include "live/protocol.h"

namespace {

using namespace ewa;

void read_answer(uint8_t kind, const std::string& answer) {
    const std::string text = "the answer " + answer.substr(0, 200);
    if (kind % 3 == 0) {
        const live::Status status = live::decode_status(answer);
        EWA_REQUIRE(status.step >= 0 && status.steps >= 0 && status.metrics.size() <= live::kMostLines);
        const std::string again = live::encode(status);
        EWA_REQUIRE(live::encode(live::decode_status(again)) == again);
    } else if (kind % 3 == 1) {
        const auto* begin = reinterpret_cast<const std::byte*>(answer.data());
        const std::vector<std::byte> bytes(begin, begin + answer.size());
        const live::Snapshot snapshot = live::decode_snapshot(bytes);
        EWA_REQUIRE(live::encode(snapshot) == bytes);
    } else {
        EWA_REQUIRE(live::payload_of(answer) <= live::kMostPayload);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size == 0) return 0;
    const std::string answer(reinterpret_cast<const char*>(data) + 1, size - 1);
    fuzz::read_within(size, 1, [&] {
        try {
            read_answer(data[0], answer);
        } catch (const InputError& error) {
            const std::string text = error.what();
            EWA_REQUIRE(!text.empty() && text.find('\n') == std::string::npos);
        }
    });
    return 0;
}
