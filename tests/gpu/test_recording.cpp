// SPDX-License-Identifier: Apache-2.0
// Recordings: which commands a barrier separates, and declarations that are wrong. Nothing runs on the
// device.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "gpu/guarded.h"
#include "gpu/twin_inputs.h"
#include "passes/shader_code.h"
#include "pipeline/backward.h"
#include "pipeline/densify.h"
#include "pipeline/mcmc.h"

namespace ewa::test {
namespace {

using gpu::Access;
using gpu::Command;
using gpu::reads;
using gpu::updates;
using gpu::writes;

gpu::Buffer words(const char* name, gpu::Texel texel = gpu::Texel::none) {
    return gpu::Buffer(*device(), name, 1024, texel);
}

/// tile_starts reads bindings 0 and 1 and writes 2.
void copy_like(gpu::Recording& recording, const gpu::Buffer& a, const gpu::Buffer& b,
               const gpu::Buffer& out) {
    rig().kernels.get<passes::TileStarts>().record(recording, rig().shape(), {a, b, out}, {1, 1});
}

bool barrier_before_last(const gpu::Recording& recording) {
    return recording.commands().back().barrier_before;
}

struct Barriers : testing::Test {
    gpu::Buffer a = words("a"), b = words("b"), c = words("c"), d = words("d"), e = words("e"),
                f = words("f");
    gpu::Recording recording = rig().recording();
};

TEST_F(Barriers, ReadAfterWrite) {
    copy_like(recording, a, b, c);
    EXPECT_FALSE(barrier_before_last(recording));
    copy_like(recording, c, b, d);
    EXPECT_TRUE(barrier_before_last(recording));
    // c was written before the barrier: reading it once more needs none.
    copy_like(recording, c, b, e);
    EXPECT_FALSE(barrier_before_last(recording));
}

TEST_F(Barriers, WriteAfterRead) {
    copy_like(recording, a, b, c);
    copy_like(recording, d, e, a);
    EXPECT_TRUE(barrier_before_last(recording));
}

TEST_F(Barriers, WriteAfterWrite) {
    copy_like(recording, a, b, c);
    copy_like(recording, d, e, c);
    EXPECT_TRUE(barrier_before_last(recording));
}

TEST_F(Barriers, IndependentCommandsAndCommonInputsNeedNone) {
    copy_like(recording, a, b, c);
    copy_like(recording, a, b, d);
    EXPECT_FALSE(barrier_before_last(recording));
    copy_like(recording, e, e, f);
    EXPECT_FALSE(barrier_before_last(recording));
}

TEST_F(Barriers, AHazardFromBeforeTheLastCommandCounts) {
    copy_like(recording, a, b, c);
    copy_like(recording, a, b, d);
    copy_like(recording, c, b, e);
    EXPECT_TRUE(barrier_before_last(recording));
}

TEST_F(Barriers, UpdatesAreBoth) {
    const auto& reset = rig().kernels.get<passes::ResetOpacity>();
    reset.record(recording, rig().shape(), {a, b, c}, {1, 1, 0});
    copy_like(recording, a, d, e);
    EXPECT_TRUE(barrier_before_last(recording));
    reset.record(recording, rig().shape(), {d, b, c}, {1, 1, 0});
    EXPECT_TRUE(barrier_before_last(recording));  // d was read
}

TEST_F(Barriers, FillsAndCopiesTakePart) {
    recording.fill(a, 0, 0, 16);
    copy_like(recording, a, b, c);
    EXPECT_TRUE(barrier_before_last(recording));
    recording.fill(b, 0, 0, 16);  // after a read
    EXPECT_TRUE(barrier_before_last(recording));
    recording.copy(b, 0, d, 0, 16);  // after a fill
    EXPECT_TRUE(barrier_before_last(recording));
    recording.copy(b, 0, e, 0, 16);
    EXPECT_FALSE(barrier_before_last(recording));
    copy_like(recording, d, e, f);
    EXPECT_TRUE(barrier_before_last(recording));
    recording.copy(a, 0, d, 0, 16);  // over what was read
    EXPECT_TRUE(barrier_before_last(recording));
    recording.fill(a, 0, 0, 0);  // nothing: no command
    EXPECT_EQ(recording.commands().size(), 7u);
}

TEST_F(Barriers, AreWrittenInTheDescription) {
    copy_like(recording, a, b, c);
    copy_like(recording, c, b, d);
    recording.fill(c, 0, 0, 16);
    recording.fill(a, 0, 0, 16);  // read before the last barrier only
    EXPECT_EQ(
        recording.describe(),
        "tile_starts: a:r b:r c:w\nbarrier\ntile_starts: c:r b:r d:w\nbarrier\nfill c: c:w\nfill a: a:w\n");
}

// ---- Wrong declarations ----

struct Declarations : testing::Test {
    static std::vector<gpu::SpecConstant> group() {
        return {passes::spec(shared::SPEC_GROUP_SIZE, rig().shape().group)};
    }
    gpu::Buffer a = words("a"), b = words("b"), c = words("c"), texels = words("texels", gpu::Texel::rgba32f);
    gpu::Pipeline starts{*device(), "tile_starts", passes::shader_code("tile_starts"), group()};
    gpu::Pipeline unpack{*device(), "unpack_target", passes::shader_code("unpack_target"), group()};
    gpu::Recording recording = rig().recording();
    const shared::TileStartsPush push{1, 1};

    /// The text of the logic_error that recording this dispatch ends with.
    template <class Push>
    std::string error(const gpu::Pipeline& pipeline, std::vector<gpu::Use> uses, const Push& constants,
                      std::array<uint32_t, 3> groups = {1, 1, 1}) {
        try {
            recording.dispatch(pipeline, "test", std::move(uses), constants, groups);
        } catch (const std::logic_error& e) {
            EXPECT_TRUE(recording.commands().empty());
            return e.what();
        }
        return "no error";
    }
    static void expect_parts(const std::string& text, std::initializer_list<const char*> parts) {
        for (const char* part : parts)
            EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
    }
};

TEST_F(Declarations, TheRightOneIsTaken) {
    EXPECT_EQ(error(starts, {writes(2, c), reads(0, a), reads(1, b)}, push), "no error");
}

TEST_F(Declarations, AccessThatIsNotTheShaders) {
    expect_parts(error(starts, {reads(0, a), reads(1, b), reads(2, c)}, push),
                 {"tile_starts", "binding 2", "(c)", "read", "write"});
    expect_parts(error(starts, {writes(0, a), reads(1, b), writes(2, c)}, push),
                 {"tile_starts", "binding 0"});
    expect_parts(error(starts, {reads(0, a), updates(1, b), writes(2, c)}, push),
                 {"tile_starts", "binding 1"});
}

TEST_F(Declarations, BindingsMissingDoubleOrUnknown) {
    expect_parts(error(starts, {reads(0, a), reads(1, b)}, push), {"tile_starts", "3 bindings", "2"});
    expect_parts(error(starts, {reads(0, a), reads(0, b), writes(2, c)}, push), {"tile_starts", "binding 0"});
    expect_parts(error(starts, {reads(0, a), reads(1, b), writes(3, c)}, push), {"tile_starts", "binding 3"});
    expect_parts(error(starts, {reads(0, a), reads(1, b), writes(2, c), writes(3, c)}, push),
                 {"tile_starts", "3 bindings", "4"});
}

TEST_F(Declarations, PushConstantsOfAnotherSize) {
    expect_parts(error(starts, {reads(0, a), reads(1, b), writes(2, c)}, shared::ScanTotalsPush{}),
                 {"no error"});
    recording = rig().recording();
    expect_parts(error(starts, {reads(0, a), reads(1, b), writes(2, c)}, shared::ResetPush{}),
                 {"tile_starts", "8 bytes", "12"});
}

TEST_F(Declarations, TexelsFetchedFromABufferWithoutAFormat) {
    expect_parts(error(unpack, {reads(0, a), writes(1, c)}, shared::UnpackPush{}),
                 {"unpack_target", "binding 0", "(a)", "texel"});
    expect_parts(error(unpack, {gpu::reads_part(0, texels, 16, 16), writes(1, c)}, shared::UnpackPush{}),
                 {"unpack_target", "binding 0", "part"});
    EXPECT_EQ(error(unpack, {reads(0, texels), writes(1, c)}, shared::UnpackPush{}), "no error");
}

/// A uniform block's buffer must have been made for it: the device would refuse it later, with less to say.
TEST_F(Declarations, AUniformBlockOnABufferThatIsNotOne) {
    const gpu::Pipeline project(*device(), "project", passes::shader_code("project"), group());
    const auto uses = [&](const gpu::Buffer& camera) {
        return std::vector<gpu::Use>{reads(0, texels), reads(1, camera), writes(2, b),
                                     writes(3, c),     writes(4, a),     updates(5, a)};
    };
    expect_parts(error(project, uses(a), shared::ProjectPush{}), {"project", "binding 1", "(a)", "uniform"});
    const gpu::Buffer camera(*device(), "camera", 1024, gpu::Texel::none, true);
    EXPECT_EQ(error(project, uses(camera), shared::ProjectPush{}), "no error");
}

TEST_F(Declarations, PartsPastTheEndAndTooManyGroups) {
    expect_parts(error(starts, {gpu::reads_part(0, a, 1008, 32), reads(1, b), writes(2, c)}, push),
                 {"tile_starts", "binding 0", "past"});
    const uint32_t most = device()->limits().max_groups;
    const std::vector<gpu::Use> good{reads(0, a), reads(1, b), writes(2, c)};
    expect_parts(error(starts, good, push, {1, 0, 1}), {"tile_starts", " 0 workgroups"});
    if (most < 0xffffffffu) {
        expect_parts(error(starts, good, push, {most + 1, 1, 1}),
                     {"tile_starts", std::to_string(most).c_str()});
        expect_parts(error(starts, good, push, {1, 1, most + 1}),
                     {"tile_starts", std::to_string(most).c_str()});
    }
}

TEST_F(Declarations, FillsAndCopiesOutsideABuffer) {
    EXPECT_THROW(recording.fill(a, 0, 0, 1028), std::logic_error);
    EXPECT_THROW(recording.fill(a, 0, 2, 4), std::logic_error);
    EXPECT_THROW(recording.copy(a, 0, b, 1020, 8), std::logic_error);
    EXPECT_THROW(recording.copy(a, 1020, b, 0, 8), std::logic_error);
}

TEST(Reflection, FindsTheBindingsOfEveryShader) {
    for (const std::string_view name : passes::shader_names()) {
        SCOPED_TRACE(std::string(name));
        const gpu::Reflection shader = gpu::reflect(passes::shader_code(name));
        ASSERT_GE(shader.bindings.size(), 2u);
        size_t written = 0;
        for (size_t i = 0; i < shader.bindings.size(); ++i) {
            EXPECT_EQ(shader.bindings[i].binding, i);  // numbered from 0 without gaps
            written += shader.bindings[i].access != Access::read;
        }
        EXPECT_GE(written, 1u);
        EXPECT_GT(shader.push_constant_bytes, 0u);
        EXPECT_LE(shader.push_constant_bytes, 128u);  // what every Vulkan device has
    }
    const gpu::Reflection update = gpu::reflect(passes::shader_code("update"));
    EXPECT_EQ(update.push_constant_bytes, sizeof(shared::UpdatePush));
    EXPECT_EQ(update.bindings[1].kind, gpu::BindingKind::uniform);
    EXPECT_EQ(update.bindings[0].kind, gpu::BindingKind::texel);
    EXPECT_EQ(update.bindings[6].access, Access::read);
    EXPECT_EQ(update.bindings[8].access, Access::read_write);
    EXPECT_EQ(update.bindings[9].access, Access::write);
    EXPECT_THROW(gpu::reflect(std::vector<uint32_t>(20, 1)), std::logic_error);
}

// ---- Hazards of a whole frame, found anew from the shaders themselves ----

struct Touch {
    const gpu::Buffer* buffer;
    bool read, write;
};

/// What a command does by its shader's SPIR-V, not by what the pass declared.
std::vector<Touch> touches(const Command& command) {
    if (command.kind == Command::Kind::fill) return {{command.uses[0].buffer, false, true}};
    if (command.kind == Command::Kind::copy)
        return {{command.uses[0].buffer, true, false}, {command.uses[1].buffer, false, true}};
    const gpu::Reflection shader = gpu::reflect(passes::shader_code(command.pipeline->name()));
    std::vector<Touch> out;
    for (const gpu::Binding& binding : shader.bindings)
        for (const gpu::Use& use : command.uses)
            if (use.binding == binding.binding)
                out.push_back({use.buffer, binding.access != Access::write, binding.access != Access::read});
    return out;
}

/// The first two commands that touch a buffer, one of them writing, with no barrier between.
std::optional<std::string> unordered_pair(const std::vector<Command>& commands) {
    std::vector<std::vector<Touch>> all;
    for (const Command& command : commands) all.push_back(touches(command));
    for (size_t later = 1; later < commands.size(); ++later)
        for (size_t earlier = later; earlier-- > 0;) {
            if (commands[earlier + 1].barrier_before) break;
            for (const Touch& x : all[earlier])
                for (const Touch& y : all[later])
                    if (x.buffer == y.buffer && (x.write || y.write))
                        return commands[earlier].name + " and " + commands[later].name + " share " +
                               x.buffer->name();
        }
    return std::nullopt;
}

/// What the commands of frames() refer to.
struct FrameParts {
    pipeline::Model model;
    pipeline::Frame frame;
    gpu::Buffer camera, photo;
    pipeline::Exposures exposures;
};
SharedByTests<FrameParts>* const frame_parts = SharedByTests<FrameParts>::add();

/// The commands of a step of training, an opacity reset and a picture with depth.
std::vector<std::vector<Command>> frames(std::vector<std::string>& pipelines) {
    Rig& r = rig();
    const Scene scene = random_scene(3000, 50, SplatKind::ordinary, 61, 47, 2);
    auto& [model, frame, camera, photo, exposures] = frame_parts->get([] { return FrameParts(); });
    exposures = pipeline::Exposures(*device(), 3);
    const pipeline::ExposureUse exposure{&exposures, 1, 0.01f, 1};
    model = pipeline::upload_model(*device(), scene.gaussians, 2, true);
    camera = camera_buffer(scene.camera, r.shape());
    photo = gpu::Buffer(*device(), "photo", 61 * 47 * 16, gpu::Texel::rgba32f);
    frame.reserve(*device(), r.shape(), {50, 61, 47, 4096, true, true, true, true});
    const pipeline::CameraUse use{&camera, 0, 61, 47};
    std::vector<std::vector<Command>> out;

    gpu::Recording step = r.recording();
    const auto plan = pipeline::plan_training(2, {}, true);
    const auto sorted = record_forward(step, r.kernels, plan, model, frame, use, {0, 0, 0});
    record_loss(step, r.kernels, frame, use, {0, 0, 0}, photo, false, &exposure);
    record_backward(step, r.kernels, plan, model, frame, use, {0, 0, 0}, sorted, {});
    record_reset_opacity(step, r.kernels, model, 0);
    record_noise(step, r.kernels, model, frame, 0.1f, 1.0f, 1, 1);
    out.push_back(step.commands());

    gpu::Recording picture = r.recording();
    record_forward(picture, r.kernels, pipeline::plan_picture(scene.gaussians, {}, true), model, frame, use,
                   {0, 0, 0});
    out.push_back(picture.commands());

    gpu::Recording gradient = r.recording();
    const auto gradient_plan = pipeline::plan_gradient(scene.gaussians, {});
    const auto again = record_forward(gradient, r.kernels, gradient_plan, model, frame, use, {0, 0, 0});
    record_loss(gradient, r.kernels, frame, use, {0, 0, 0}, photo, true);
    record_backward(gradient, r.kernels, gradient_plan, model, frame, use, {0, 0, 0}, again, {});
    out.push_back(gradient.commands());
    for (const auto& commands : out)
        for (const Command& command : commands)
            if (command.pipeline) pipelines.push_back(command.pipeline->name());
    return out;
}

TEST(FrameHazards, EveryPairHasABarrierBetween) {
    std::vector<std::string> pipelines;
    for (const auto& commands : frames(pipelines)) {
        const auto pair = unordered_pair(commands);
        EXPECT_FALSE(pair.has_value()) << *pair;
    }
    // All shaders but those of densification, which runs between frames, of a window's pictures, and of
    // meshes.
    for (const std::string_view name : passes::shader_names())
        EXPECT_TRUE(name.substr(0, 7) == "densify" || name.substr(0, 5) == "mcmc_" || name == "pack" ||
                    name.substr(0, 6) == "trace_" ||
                    std::find(pipelines.begin(), pipelines.end(), name) != pipelines.end())
            << name;
}

/// The check itself: each barrier taken away in turn is found missing, so every barrier is also needed.
TEST(FrameHazards, EveryBarrierIsNeeded) {
    std::vector<std::string> pipelines;
    for (const auto& commands : frames(pipelines)) {
        size_t barriers = 0;
        for (size_t i = 0; i < commands.size(); ++i) {
            if (!commands[i].barrier_before) continue;
            ++barriers;
            auto without = commands;
            without[i].barrier_before = false;
            EXPECT_TRUE(unordered_pair(without).has_value()) << "before " << commands[i].name;
        }
        EXPECT_GT(barriers, 10u);
    }
}

}  // namespace
}  // namespace ewa::test
