// SPDX-License-Identifier: Apache-2.0
// Any bytes as an image of a dataset, with the decoder of its format: an image of its size, or an error of one
// line. The decoders hold a whole image in memory, so the limit is 4 times the file and 300 MB.
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "input.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace ewa;
    static fuzz::MemoryFile file;
    const std::string& path = file.hold(data, size);
    fuzz::peak = fuzz::live.load();
    const long long before = fuzz::peak;
    std::string text = "an image of " + std::to_string(size) + " bytes";
    const std::clock_t start = std::clock();
    try {
        const Image image = load_image(path);
        EWA_REQUIRE(image.width > 0 && image.height > 0 && (image.channels == 3 || image.channels == 4));
    } catch (const InputError& error) {
        text = error.what();
        EWA_REQUIRE(text == core::one_line(text) && text.size() < 2000);
    }
    EWA_REQUIRE(double(std::clock() - start) < 5.0 * CLOCKS_PER_SEC);
    EWA_REQUIRE(fuzz::peak - before <= 4 * static_cast<long long>(size) + (300ll << 20));
    return 0;
}
