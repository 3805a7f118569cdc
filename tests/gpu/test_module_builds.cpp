// SPDX-License-Identifier: Apache-2.0
// Modules that the build has made from whole ones, so that drivers compile them faster.
#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <vector>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "passes/shader_code.h"

namespace ewa::test {
namespace {

void expect_same_bindings(const gpu::Reflection& a, const gpu::Reflection& b) {
    EXPECT_EQ(a.push_constant_bytes, b.push_constant_bytes);
    EXPECT_EQ(a.uses_subgroups, b.uses_subgroups);
    ASSERT_EQ(a.bindings.size(), b.bindings.size());
    for (size_t i = 0; i < a.bindings.size(); ++i) {
        EXPECT_EQ(a.bindings[i].kind, b.bindings[i].kind);
        EXPECT_EQ(a.bindings[i].access, b.bindings[i].access);
    }
}

/// A module for pinholes differs from the whole one in that it is smaller and has no constant of lenses.
TEST(PinholeCode, HasTheBindingsOfTheWholeModule) {
    int found = 0;
    for (const std::string_view name : passes::shader_names())
        for (const bool texel_buffers : {true, false}) {
            const std::span<const uint32_t> pinhole = passes::pinhole_code(name, texel_buffers);
            if (pinhole.empty()) continue;
            SCOPED_TRACE(name);
            ++found;
            const std::span<const uint32_t> whole = passes::shader_code(name, texel_buffers);
            EXPECT_LT(pinhole.size(), 0.7 * double(whole.size()));
            const gpu::Reflection a = gpu::reflect(pinhole), b = gpu::reflect(whole);
            std::vector<uint32_t> expected = b.constants;
            EXPECT_EQ(std::erase(expected, shared::SPEC_LENSES), 1u);
            EXPECT_EQ(a.constants, expected);
            expect_same_bindings(a, b);
        }
    EXPECT_EQ(found, 10);
}

TEST(PinholeCode, IsTakenForPinholesAlone) {
    passes::PassCache cache(*device());
    const auto module_of = [&](uint32_t lenses) {
        passes::Constants variant{
            {shared::SPEC_SH_DEGREE, 0}, {shared::SPEC_MODE, 0}, {shared::SPEC_KERNEL, 0}};
        variant.push_back({shared::SPEC_LENSES, lenses});
        return cache.get<passes::Update>(variant).pipeline.reflection().constants;
    };
    const auto has_lenses = [&](uint32_t lenses) {
        const std::vector<uint32_t> constants = module_of(lenses);
        return std::ranges::binary_search(constants, shared::SPEC_LENSES);
    };
    EXPECT_FALSE(has_lenses(shared::LENSES_PINHOLE));
    EXPECT_TRUE(has_lenses(shared::LENSES_ANY));
}

/// It has no constants that the whole module declares and never reads.
TEST(OptimisedCode, HasTheBindingsOfTheWholeModule) {
    int found = 0;
    for (const std::string_view name : passes::shader_names()) {
        const std::span<const uint32_t> optimised = passes::optimised_code(name);
        if (optimised.empty()) continue;
        SCOPED_TRACE(name);
        ++found;
        const gpu::Reflection a = gpu::reflect(optimised), b = gpu::reflect(passes::shader_code(name, true));
        EXPECT_TRUE(std::ranges::includes(b.constants, a.constants));
        expect_same_bindings(a, b);
    }
    EXPECT_EQ(found, 7);
}

/// A device keeps one pipeline for each module.
TEST(OptimisedCode, IsUsedUnlessWholeModulesAreAskedFor) {
    passes::PassCache cache(*device());
    passes::KernelConfig config = cache.config();
    if (!config.texel_buffers) GTEST_SKIP() << "the device has storage buffers in place of texel buffers";
    config.optimised_modules = false;
    passes::PassCache whole(*device(), config);
    EXPECT_NE(&cache.get<passes::LossColumns>().pipeline, &whole.get<passes::LossColumns>().pipeline);
    EXPECT_EQ(&cache.get<passes::Reduce>().pipeline, &whole.get<passes::Reduce>().pipeline);
}

}  // namespace
}  // namespace ewa::test
