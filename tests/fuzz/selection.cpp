// SPDX-License-Identifier: Apache-2.0
// Any text as a selection of three splats that touch: it is taken, or refused with one short line.
#include <memory>

#include "edit/edited_splats.h"
#include "edit/edits.h"
#include "ewa/error.h"
#include "input.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace ewa;
    static const auto splats = [] {
        Gaussians row;
        row.resize(3);
        for (size_t i = 0; i < row.size(); ++i) {
            row.means[3 * i] = float(i);
            row.quaternions[4 * i] = 1;
        }
        return std::make_shared<const Gaussians>(std::move(row));
    }();
    const std::string shape(reinterpret_cast<const char*>(data), size);
    fuzz::read_within(size, 1, [&] {
        std::string text = shape.substr(0, 200);
        try {
            edit::EditedSplats edited(splats);
            edit::perform_on(edited, edit::parse("select", shape));
            EWA_REQUIRE(edited.left() == splats->size());
        } catch (const InputError& error) {
            text = error.what();
            EWA_REQUIRE(text.starts_with("--select: "));
        }
    });
    return 0;
}
