// SPDX-License-Identifier: Apache-2.0
// Any text as the status of a training, and as its answer to an edit. What is taken comes back the same from the text that it is written
// as.
#include "live/status.h"

#include "ewa/error.h"
#include "input.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace ewa;
    const std::string answer(reinterpret_cast<const char*>(data), size);
    fuzz::read_within(size, 1, [&] {
        std::string text = "the answer " + answer.substr(0, 200);
        try {
            const live::Status status = live::decode_status(answer);
            EWA_REQUIRE(status.step >= 0 && status.steps >= 0 && status.metrics.size() <= live::kMostLines);
            const std::string again = live::encode(status);
            EWA_REQUIRE(live::encode(live::decode_status(again)) == again);
        } catch (const InputError& error) {
            text = error.what();
            EWA_REQUIRE(!text.empty() && text.find('\n') == std::string::npos);
        }
        try {
            const std::string reply = live::encode(live::decode_edit_reply(answer));
            EWA_REQUIRE(live::encode(live::decode_edit_reply(reply)) == reply);
        } catch (const InputError& error) {
            text = error.what();
            EWA_REQUIRE(!text.empty() && text.find('\n') == std::string::npos);
        }
    });
    return 0;
}
