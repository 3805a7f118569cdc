// SPDX-License-Identifier: Apache-2.0
// Recordings: which commands a barrier separates, what a dispatch refuses, and what reflection finds. Nothing
// runs on the device.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <ranges>
#include <set>
#include <stdexcept>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "passes/shader_code.h"
#include "pipeline/appearances.h"
#include "pipeline/backward.h"
#include "pipeline/sky.h"
#include "pipeline/strategy.h"
#include "pipeline/views.h"

namespace ewa::test {
namespace {

struct Accesses {
    bool read = false, write = false;
};

/// What the instructions of a SPIR-V module do with each binding (section 3.49 of the specification).
std::map<uint32_t, Accesses> instruction_accesses(std::span<const uint32_t> spirv) {
    constexpr uint32_t kDecorate = 71, kDecorationBinding = 33;
    constexpr uint32_t kLoad = 61, kStore = 62, kAccessChain = 65, kInBoundsAccessChain = 66;
    constexpr uint32_t kFirstAtomic = 227, kLastAtomic = 242, kAtomicLoad = 227, kAtomicStore = 228;
    constexpr uint32_t kFunctionCall = 57, kVariable = 59, kUniformConstant = 0, kCopyMemory = 63;
    std::map<uint32_t, uint32_t> base;  // pointer or variable -> binding
    std::set<uint32_t> texel_buffers;   // variables
    std::map<uint32_t, Accesses> result;
    const auto touch = [&](uint32_t pointer, bool read, bool write) {
        if (const auto found = base.find(pointer); found != base.end()) {
            result[found->second].read |= read;
            result[found->second].write |= write;
        }
    };
    for (size_t at = 5; at < spirv.size(); at += spirv[at] >> 16) {
        const uint32_t op = spirv[at] & 0xffff;
        const auto words = spirv.subspan(at, spirv[at] >> 16);
        if (op == kDecorate && words[2] == kDecorationBinding) base[words[1]] = words[3];
        if (op == kVariable && words[3] == kUniformConstant) texel_buffers.insert(words[2]);
        if (op == kAccessChain || op == kInBoundsAccessChain)
            if (const auto found = base.find(words[3]); found != base.end()) base[words[2]] = found->second;
        if (op == kLoad) touch(words[3], true, false);
        if (op == kStore) touch(words[1], false, true);
        if (op >= kFirstAtomic && op <= kLastAtomic)
            touch(words[op == kAtomicStore ? 1 : 3], op != kAtomicStore, op != kAtomicLoad);
        // Functions take texel buffers by pointer, to read them. Nothing else is expected here.
        if (op == kFunctionCall || op == kCopyMemory)
            for (const uint32_t word : words.subspan(1)) touch(word, true, !texel_buffers.count(word));
    }
    return result;
}

using gpu::Access;
using gpu::BufferPart;
using gpu::Command;

gpu::Buffer words(const char* name, gpu::Texel texel = gpu::Texel::none) {
    return gpu::Buffer(*device(), name, 1024, texel);
}

/// tile_starts reads bindings 0 and 1 and writes 2.
void copy_like(gpu::Recording& recording, const gpu::Buffer& a, const gpu::Buffer& b,
               const gpu::Buffer& out) {
    rig().cache.get<passes::TileStarts>().record(recording, {.keys = a, .counts = b, .tile_starts = out},
                                                 {1, 1});
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

/// Buffers in the memory of another one: what counts is whether bytes are the same.
TEST_F(Barriers, OfBuffersThatShareMemory) {
    const gpu::Buffer memory(*device(), "memory", 4 * gpu::Buffer::kPlacement, gpu::Texel::any);
    const auto in_memory = [&](uint64_t place, uint64_t bytes) {
        return gpu::Buffer(memory, place * gpu::Buffer::kPlacement, "part", bytes, gpu::Texel::none);
    };
    const gpu::Buffer first = in_memory(0, 2 * gpu::Buffer::kPlacement), second = in_memory(1, 1024),
                      third = in_memory(2, 1024);
    EXPECT_TRUE(first.overlaps(second) && second.overlaps(first));
    EXPECT_FALSE(first.overlaps(third) || third.overlaps(first) || second.overlaps(third) ||
                 first.overlaps(a));
    copy_like(recording, a, b, first);
    copy_like(recording, a, b, third);
    EXPECT_FALSE(barrier_before_last(recording));
    copy_like(recording, second, b, c);  // read after a write of the same bytes
    EXPECT_TRUE(barrier_before_last(recording));
    copy_like(recording, d, e, first);  // write after a read
    EXPECT_TRUE(barrier_before_last(recording));
    EXPECT_THROW(in_memory(3, 2 * gpu::Buffer::kPlacement), std::logic_error);
    EXPECT_THROW(gpu::Buffer(memory, 16, "part", 16, gpu::Texel::none), std::logic_error);
    EXPECT_THROW(gpu::Buffer(a, 0, "part", 16, gpu::Texel::none), std::logic_error);
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
    const auto reset = rig().cache.get<passes::ResetOpacity>();
    reset.record(recording, {a, b, c}, {1, 1, 0});
    copy_like(recording, a, d, e);
    EXPECT_TRUE(barrier_before_last(recording));
    reset.record(recording, {d, b, c}, {1, 1, 0});
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

TEST_F(Barriers, WritesTakePart) {
    const uint32_t words[] = {1, 2};
    recording.write(a, 4, std::as_bytes(std::span(words)));
    copy_like(recording, b, b, c);
    EXPECT_FALSE(barrier_before_last(recording));
    copy_like(recording, a, b, d);
    EXPECT_TRUE(barrier_before_last(recording));
    recording.write(a, 4, std::as_bytes(std::span(words)));
    EXPECT_TRUE(barrier_before_last(recording));
    EXPECT_EQ(
        recording.describe(),
        "write a: a:w\ntile_starts: b:r b:r c:w\nbarrier\ntile_starts: a:r b:r d:w\nbarrier\nwrite a: a:w\n");
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

/// The device reads workgroups in a buffer at a stage of its own. A barrier that orders them says so, wherever it stands.
TEST_F(Barriers, OfWorkgroupsInABuffer) {
    const auto starts = rig().cache.get<passes::TileStarts>();
    const gpu::BufferPart groups(c, 16, 12);
    copy_like(recording, a, b, c);
    starts.record(recording, {.keys = a, .counts = b, .tile_starts = d}, {1, 1}, groups);  // c was written
    copy_like(recording, a, b, c);  // over workgroups that were read
    copy_like(recording, d, b, e);
    copy_like(recording, e, b, f);  // a barrier, which also orders the workgroups of the next command
    starts.record(recording, {.keys = a, .counts = b, .tile_starts = a}, {1, 1}, groups);
    EXPECT_EQ(recording.describe(),
              "tile_starts: a:r b:r c:w\n"
              "barrier groups\ntile_starts: a:r b:r d:w groups c:r\n"
              "barrier\ntile_starts: a:r b:r c:w\ntile_starts: d:r b:r e:w\n"
              "barrier groups\ntile_starts: e:r b:r f:w\n"
              "tile_starts: a:r b:r a:w groups c:r\n");
}

// ---- What a dispatch refuses ----

struct Dispatches : testing::Test {
    static std::vector<gpu::SpecConstant> constants() {
        return {{shared::SPEC_GROUP_SIZE, 64}, {shared::SPEC_CUT_OFF, 0}, {shared::SPEC_COLOR_FLOATS, 0}};
    }
    gpu::Buffer a = words("a"), b = words("b"), c = words("c"), texels = words("texels", gpu::Texel::rgba32f);
    static gpu::Pipeline pipeline(const char* shader) {
        return {*device(), shader, passes::shader_code(shader, device()->limits().texel_buffers),
                constants()};
    }
    gpu::Pipeline starts = pipeline("tile_starts"), unpack = pipeline("unpack_target");
    gpu::Recording recording = rig().recording();
    const shared::TileStartsPush push{1, 1};

    /// The text of the logic_error that recording this dispatch ends with.
    template <class Push>
    std::string error(const gpu::Pipeline& pipeline, const std::vector<BufferPart>& parts, const Push& values,
                      const gpu::Workgroups& groups = std::array<uint32_t, 3>{1, 1, 1}) {
        try {
            recording.dispatch(pipeline, "test", parts, std::as_bytes(std::span(&values, 1)), groups);
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

TEST_F(Dispatches, TakeTheirAccessFromTheShader) {
    EXPECT_EQ(error(starts, {a, b, c}, push), "no error");
    EXPECT_EQ(recording.describe(), "test: a:r b:r c:w\n");
}

TEST_F(Dispatches, RefuseTooFewOrTooManyBuffers) {
    expect_parts(error(starts, {a, b}, push), {"tile_starts", "3 bindings", "2"});
    expect_parts(error(starts, {a, b, c, c}, push), {"tile_starts", "3 bindings", "4"});
}

TEST_F(Dispatches, RefusePushConstantsOfAnotherSize) {
    expect_parts(error(starts, {a, b, c}, shared::ScanPush{}), {"no error"});
    recording = rig().recording();
    expect_parts(error(starts, {a, b, c}, shared::ResetPush{}), {"tile_starts", "8 bytes", "12"});
}

TEST_F(Dispatches, RefuseTexelsOfABufferWithoutAFormat) {
    if (!device()->limits().texel_buffers) GTEST_SKIP() << "no buffer can be fetched as texels";
    expect_parts(error(unpack, {a, c}, shared::UnpackPush{}), {"unpack_target", "binding 0", "(a)", "texel"});
    expect_parts(error(unpack, {BufferPart(texels, 16, 16), c}, shared::UnpackPush{}),
                 {"unpack_target", "binding 0", "part"});
    EXPECT_EQ(error(unpack, {texels, c}, shared::UnpackPush{}), "no error");
}

/// A uniform block's buffer must have been made for it: the device would refuse it later, with less to say.
TEST_F(Dispatches, RefuseAUniformBlockOnABufferThatIsNotOne) {
    auto& cache = rig().cache;
    const auto& project =
        cache
            .get<passes::Project>(
                {{shared::SPEC_SH_DEGREE, 0}, {shared::SPEC_KERNEL, 0}, {shared::SPEC_MODE, 0}})
            .pipeline;
    const auto parts = [&](const gpu::Buffer& camera) {
        return std::vector<BufferPart>{texels, camera, b, c, a, a, texels};
    };
    expect_parts(error(project, parts(a), shared::ProjectPush{}), {"project", "binding 1", "(a)", "uniform"});
    const gpu::Buffer camera(*device(), "camera", 1024, gpu::Texel::none, true);
    EXPECT_EQ(error(project, parts(camera), shared::ProjectPush{}), "no error");
}

TEST_F(Dispatches, RefusePartsPastTheEndAndTooManyGroups) {
    expect_parts(error(starts, {BufferPart(a, 1008, 32), b, c}, push), {"tile_starts", "binding 0", "past"});
    const uint32_t most = device()->limits().max_groups;
    expect_parts(error(starts, {a, b, c}, push, std::array{1u, 0u, 1u}), {"tile_starts", " 0 workgroups"});
    if (most < 0xffffffffu) {
        expect_parts(error(starts, {a, b, c}, push, std::array{most + 1, 1u, 1u}),
                     {"tile_starts", std::to_string(most).c_str()});
        expect_parts(error(starts, {a, b, c}, push, std::array{1u, 1u, most + 1}),
                     {"tile_starts", std::to_string(most).c_str()});
    }
}

TEST_F(Dispatches, RefuseWorkgroupsOutsideABuffer) {
    const auto error_of = [&](const BufferPart& groups) {
        recording = rig().recording();
        return error(starts, {a, b, c}, push, groups);
    };
    expect_parts(error_of(BufferPart(a, 1016, 8)), {"tile_starts", "workgroups at byte 1016", "1024"});
    expect_parts(error_of(BufferPart(a, 2, 12)), {"tile_starts", "workgroups at byte 2"});
    EXPECT_EQ(error_of(BufferPart(a, 1012, 12)), "no error");
}

TEST_F(Dispatches, FillsAndCopiesStayInsideABuffer) {
    EXPECT_THROW(recording.fill(a, 0, 0, 1028), std::logic_error);
    EXPECT_THROW(recording.fill(a, 0, 2, 4), std::logic_error);
    EXPECT_THROW(recording.copy(a, 0, b, 1020, 8), std::logic_error);
    EXPECT_THROW(recording.copy(a, 1020, b, 0, 8), std::logic_error);
    const std::vector<std::byte> bytes(1028);
    for (const auto& [offset, count] : {std::pair{0, 1028}, {1020, 8}, {2, 4}, {0, 6}, {0, 0}})
        EXPECT_THROW(recording.write(a, uint64_t(offset), std::span(bytes).first(size_t(count))),
                     std::logic_error);
}

TEST(Constants, AreCompleteAndDeclaredByTheShader) {
    const auto error = [](const passes::Constants& variant) -> std::string {
        try {
            rig().cache.get<passes::Blend>(variant);
        } catch (const std::logic_error& e) {
            return e.what();
        }
        return "no error";
    };
    EXPECT_EQ(error({{shared::SPEC_MODE, shared::BLEND_COLOR}}), "no error");
    EXPECT_EQ(error({}), "shader blend: specialisation constant 6 is not given");
    EXPECT_EQ(error({{shared::SPEC_MODE, 0}, {shared::SPEC_SH_DEGREE, 0}}),
              "shader blend has no specialisation constant 4");
}

/// Calls visit(module) for both builds of every shader.
template <class Visit>
void for_each_module(Visit visit) {
    for (const std::string_view name : passes::shader_names())
        for (const bool texel_buffers : {true, false}) {
            SCOPED_TRACE(std::string(name) + (texel_buffers ? "" : " (storage)"));
            visit(passes::shader_code(name, texel_buffers));
        }
}

/// Renderers and trainers come and go on one device; only the first compiles.
TEST(PassCache, SharesWhatTheDeviceCompiled) {
    passes::PassCache one(*device()), two(*device());
    EXPECT_EQ(&one.get<passes::TileStarts>().pipeline, &two.get<passes::TileStarts>().pipeline);
    passes::KernelConfig other = one.config();
    other.element_group /= 2;  // with 4 lanes, devices may take no more than 128 invocations
    passes::PassCache three(*device(), other);
    EXPECT_NE(one.get<passes::TileStarts>().pipeline.handle(),
              three.get<passes::TileStarts>().pipeline.handle());
}

TEST(WithValues, ChangesTheDefaultsOfConstantsAndNothingElse) {
    for_each_module([](std::span<const uint32_t> spirv) {
        passes::Constants given;
        for (const uint32_t id : gpu::reflect(spirv).constants) given.push_back({id, 0x5eed0000 + id});
        const std::vector<uint32_t> changed = gpu::with_values(spirv, given);
        ASSERT_EQ(changed.size(), spirv.size());
        std::vector<uint32_t> values;
        for (size_t i = 0; i < spirv.size(); ++i)
            if (changed[i] != spirv[i]) values.push_back(changed[i] - 0x5eed0000);
        std::ranges::sort(values);
        EXPECT_EQ(values, gpu::reflect(spirv).constants);
        EXPECT_EQ(gpu::with_values(spirv, {}), std::vector<uint32_t>(spirv.begin(), spirv.end()));
    });
}

TEST(Reflection, FindsTheBindingsOfEveryShader) {
    for_each_module([](std::span<const uint32_t> code) {
        const gpu::Reflection shader = gpu::reflect(code);
        ASSERT_GE(shader.bindings.size(), 2u);
        size_t written = 0;
        for (size_t i = 0; i < shader.bindings.size(); ++i) {
            EXPECT_EQ(shader.bindings[i].binding, i);  // numbered from 0 without gaps
            written += shader.bindings[i].access != Access::read;
        }
        EXPECT_GE(written, 1u);
        EXPECT_TRUE(shader.push_constant_bytes > 0 ||
                    std::ranges::count(shader.bindings, gpu::BindingKind::uniform, &gpu::Binding::kind) > 0);
        EXPECT_LE(shader.push_constant_bytes, 128u);  // what every Vulkan device has
    });
    const gpu::Reflection update = gpu::reflect(passes::shader_code("update", true));
    EXPECT_EQ(update.push_constant_bytes, 0u);
    EXPECT_EQ(update.bindings[14].kind, gpu::BindingKind::uniform);
    EXPECT_EQ(update.bindings[1].kind, gpu::BindingKind::uniform);
    EXPECT_EQ(update.bindings[0].kind, gpu::BindingKind::texel);
    EXPECT_EQ(gpu::reflect(passes::shader_code("update", false)).bindings[0].kind, gpu::BindingKind::storage);
    EXPECT_EQ(update.bindings[6].access, Access::read);
    EXPECT_EQ(update.bindings[8].access, Access::read_write);
    EXPECT_EQ(update.bindings[9].access, Access::write);
    EXPECT_THROW(gpu::reflect(std::vector<uint32_t>(20, 1)), std::logic_error);
}

/// Barriers are minimal and safe only if each buffer's decorations say what the shader does: a buffer that is
/// only read is readonly, and one that is only written is writeonly.
TEST(Reflection, EveryBufferIsDecoratedAsItIsUsed) {
    for_each_module([](std::span<const uint32_t> code) {
        const auto used = instruction_accesses(code);
        for (const gpu::Binding& binding : gpu::reflect(code).bindings) {
            SCOPED_TRACE("binding " + std::to_string(binding.binding));
            const auto found = used.find(binding.binding);
            ASSERT_NE(found, used.end()) << "no instruction uses it";
            const auto [read, write] = found->second;
            ASSERT_TRUE(read || write);
            EXPECT_EQ(binding.access, read && write ? Access::read_write
                                      : read        ? Access::read
                                                    : Access::write);
        }
    });
}

// ---- Hazards of a whole frame, found from the instructions of the shaders ----

struct Touch {
    const gpu::Buffer* buffer;
    bool read, write;
};

/// What a command does by the loads and stores of its shader, not by what the shader's decorations say.
std::vector<Touch> touches(const Command& command) {
    if (command.kind == Command::Kind::fill || command.kind == Command::Kind::write)
        return {{command.uses[0].part.buffer, false, true}};
    if (command.kind == Command::Kind::copy)
        return {{command.uses[0].part.buffer, true, false}, {command.uses[1].part.buffer, false, true}};
    const auto accesses =
        instruction_accesses(passes::shader_code(command.pipeline->name(), device()->limits().texel_buffers));
    std::vector<Touch> out;
    for (const auto& [binding, access] : accesses)
        out.push_back({command.uses.at(binding).part.buffer, access.read, access.write});
    if (command.indirect()) out.push_back({command.uses.back().part.buffer, true, false});
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
                    if (x.buffer->overlaps(*y.buffer) && (x.write || y.write))
                        return commands[earlier].name + " and " + commands[later].name + " share " +
                               x.buffer->name();
        }
    return std::nullopt;
}

/// What the commands of frames() refer to.
struct FrameParts {
    pipeline::Model model;
    pipeline::FrameBuffers frame;
    pipeline::FrameBuffers wide;    // its tiles are sorted in several passes
    pipeline::FrameBuffers listed;  // each tile's list is sorted by itself
    gpu::Buffer camera, photo;
    pipeline::Appearances exposures, ppisp, grids;
    pipeline::Motions motions;
    pipeline::LearnedSky sky;
    pipeline::ViewBuffers views;
};
SharedByTests<FrameParts>* const frame_parts = SharedByTests<FrameParts>::add();

void record_gradient(const FrameParts& parts, gpu::Recording& recording, const pipeline::PlanRequest& request,
                     const pipeline::FrameInputs& inputs, bool masked = false, bool cut = false,
                     bool depths = false) {
    const auto plan = plan_for(request);
    const pipeline::FramePasses on{{recording, rig().cache}, plan, parts.frame, inputs};
    const auto sorted = on.forward(parts.model);
    on.loss(parts.photo, masked, nullptr, cut, {depths ? &parts.photo : nullptr});
    on.backward(parts.model, sorted, {});
}

/// The commands of a step of training, an opacity reset, a picture with depth, and gradients, also of points and along rays.
std::vector<std::vector<Command>> frames(std::vector<std::string>& pipelines) {
    Rig& r = rig();
    const Scene scene = random_scene(3000, 50, SplatKind::ordinary, 61, 47, 2);
    FrameParts& parts = frame_parts->get([] { return FrameParts(); });
    auto& [model, frame, wide, listed, camera, photo, exposures, ppisp, grids, motions, sky, views] = parts;
    exposures = pipeline::Appearances(*device(), AppearanceModel::affine, {0, 0, 0}, 1);
    const pipeline::AppearanceUse exposure{&exposures, 1, 0, 0.01f, 1};
    ppisp = pipeline::Appearances(*device(), AppearanceModel::ppisp, {0, 1, 0}, 2);
    grids = pipeline::Appearances(*device(), AppearanceModel::grid, {0, 0}, 1);
    sky = pipeline::LearnedSky(*device(), 1);
    motions = pipeline::Motions(*device(), {std::vector<pipeline::MotionBasis>(3), {}, {}});
    const pipeline::MotionUse motion{.motions = &motions, .photo = 1};
    model = pipeline::upload_model(*device(), scene.gaussians, 2, true);
    camera = camera_buffer(scene.camera, r.config());
    photo = gpu::Buffer(*device(), "photo", 61 * 47 * 16, gpu::Texel::rgba32f);
    frame.reserve(*device(), r.config(),
                  {.splats = 50,
                   .width = 61,
                   .height = 47,
                   .instances = 4096,
                   .gradients = true,
                   .fifth_plane = true,
                   .masks = true,
                   .appearance = AppearanceModel::grid,  // whose sums have room for those of others
                   .overlaid = true,
                   .motion = true,
                   .rays = true,
                   .loss = {.l2 = 1, .alpha = 1, .depth = 1}});
    const pipeline::FrameInputs inputs{.camera = {&camera, 0, 61, 47}};
    std::vector<std::vector<Command>> out;

    pipeline::PlanRequest request{.purpose = pipeline::Purpose::training,
                                  .scene_degree = 2,
                                  .present_degree = 2,
                                  .render = {},
                                  .drawing = Drawing::depth,
                                  .motion = true,
                                  .statistics = true};
    gpu::Recording step = r.recording();
    const auto plan = plan_for(request);
    const pipeline::FrameInputs moved{
        .camera = record_move_camera({step, r.cache}, motions, motion.photo, inputs.camera)};
    const pipeline::FramePasses stepped{{step, r.cache}, plan, frame, moved};
    const auto sorted = stepped.forward(model);
    stepped.loss(photo, false, &exposure);
    stepped.backward(model, sorted, {}, &motion);
    record_reset_opacity(stepped, model, 0);
    record_noise(stepped, model, frame, {.amplitude = 0.1f, .max_length = 1, .seed = 1, .step = 1});
    out.push_back(step.commands());

    // Other models of the images' appearance.
    gpu::Recording appearance = r.recording();
    const pipeline::FramePasses shown{{appearance, r.cache}, plan, frame, inputs};
    for (const pipeline::Appearances* each : {&ppisp, &grids}) {
        const pipeline::AppearanceUse use{each, 1, 0, 0.01f, 1};
        shown.loss(photo, false, &use);
        const uint32_t photos[] = {1};
        record_cameras_update(shown, *each, frame, photos, 0.01f, frame.instance_capacity);
    }
    out.push_back(appearance.commands());

    // A sky that is learned.
    gpu::Recording behind = r.recording();
    pipeline::FrameInputs over_sky = inputs;
    over_sky.sky = sky.use();
    const pipeline::FramePasses under_sky{{behind, r.cache}, plan, frame, over_sky};
    under_sky.forward(model);
    under_sky.loss(photo);
    under_sky.sky_gradient(sky, 0);
    record_sky_update(under_sky, sky, frame, 1, 0.01f, 1, frame.instance_capacity);
    out.push_back(behind.commands());

    // A step of two views. The sums have room for both.
    request.motion = false;
    const auto plan_of_views = plan_for(request);
    views.reserve(*device(), 50, 2, 1, 50);
    views.reserve_sums(*device(), r.executor, plan_of_views, 100);
    gpu::Recording batch = r.recording();
    const pipeline::FramePasses of_views{{batch, r.cache}, plan_of_views, frame, inputs};
    for (uint32_t view = 0; view < 2; ++view) {
        of_views.list(model, views, {.view = view, .list = view, .first_index = 50 * view});
        batch.copy(views.visible, 0, frame.records, 0, 48 * 50);
        const auto drawn = of_views.draw_list(50);
        of_views.loss(photo);
        of_views.list_backward(50, drawn, views.sums, 50 * view);
    }
    pipeline::Rates rates;
    rates.views = 2;
    of_views.update_views(model, views, rates);
    // A step of one view in two bands.
    for (uint32_t band = 0; band < 2; ++band) {
        pipeline::FrameInputs of_band = inputs;
        of_band.band = pipeline::band_of(r.config(), 47, 2, band);
        pipeline::FramePasses{{batch, r.cache}, plan_of_views, frame, of_band}.list(
            model, views, {.list = band, .first_index = 50 * band}, band > 0);
    }
    rates.views = 1;
    of_views.update_views(model, views, rates, 2);
    out.push_back(batch.commands());

    request.purpose = pipeline::Purpose::image;
    gpu::Recording picture = r.recording();
    pipeline::FramePasses{{picture, r.cache}, plan_for(request), frame, inputs}.forward(model);
    wide.reserve(*device(), r.config(),
                 {.splats = 50, .width = 66000, .height = 9, .instances = 4096, .fifth_plane = true});
    pipeline::FramePasses{{picture, r.cache}, plan_for(request), wide, {.camera = {&camera, 0, 66000, 9}}}
        .forward(model);
    out.push_back(picture.commands());

    request.purpose = pipeline::Purpose::gradient;
    gpu::Recording gradient = r.recording();
    record_gradient(parts, gradient, request, inputs, true);
    out.push_back(gradient.commands());

    passes::KernelConfig with_lists = r.config();
    with_lists.sorted_lists = 50;
    listed.reserve(*device(), with_lists,
                   {.splats = 50,
                    .width = 61,
                    .height = 47,
                    .instances = 4096,
                    .gradients = true,
                    .fifth_plane = true,
                    .overlaid = true,
                    .loss = {}});
    gpu::Recording lists = r.recording();
    const auto plan_of_lists = plan_for(request);
    const pipeline::FramePasses of_lists{{lists, r.cache}, plan_of_lists, listed, inputs};
    const auto in_lists = of_lists.forward(model);
    of_lists.loss(photo);
    of_lists.backward(model, in_lists, {});
    out.push_back(lists.commands());

    // All terms of a loss.
    request.alpha = request.depths = true;
    request.loss = {.l2 = 1, .alpha = 1, .depth = 1};
    gpu::Recording terms = r.recording();
    record_gradient(parts, terms, request, inputs, false, true, true);
    record_gradient(parts, terms, request, inputs);
    request.alpha = false;
    record_gradient(parts, terms, request, inputs);
    out.push_back(terms.commands());
    request.depths = false;
    request.loss = {};

    request.render.points = true;
    gpu::Recording points = r.recording();
    record_gradient(parts, points, request, inputs);
    out.push_back(points.commands());

    request.render.points = false;
    request.drawing = Drawing::color;
    for (const Integrator integrator : {Integrator::ray, Integrator::fast_ray, Integrator::march}) {
        request.render.integrator = integrator;
        gpu::Recording rays = r.recording();
        record_gradient(parts, rays, request, inputs);
        out.push_back(rays.commands());
    }
    for (const auto& commands : out)
        for (const Command& command : commands)
            if (command.pipeline) pipelines.push_back(command.pipeline->name());
    return out;
}

/// Recordings of random commands over few buffers: wherever a command reads or overwrites what another wrote,
/// or overwrites what another read, a barrier is between them, and no barrier is superfluous.
TEST(RandomRecordings, HaveTheBarriersTheyNeed) {
    const gpu::Buffer buffers[] = {words("a"), words("b"), words("c"), words("d"), words("e"), words("f")};
    const auto reset = rig().cache.get<passes::ResetOpacity>();
    for (const uint64_t seed : {1, 2, 3}) {
        Random random(seed);
        gpu::Recording recording = rig().recording();
        const auto any = [&]() -> const gpu::Buffer& { return buffers[random.bits() % 6]; };
        for (int k = 0; k < 150; ++k) switch (random.bits() % 4) {
                case 0:
                    recording.fill(any(), 0, 0, 16);
                    break;
                case 1:
                    recording.copy(any(), 0, any(), 16, 16);
                    break;
                case 2:
                    reset.record(recording, {.params = any(), .moments1 = any(), .moments2 = any()},
                                 {1, 1, 0});
                    break;
                default:
                    copy_like(recording, any(), any(), any());
            }
        EXPECT_EQ(unordered_pair(recording.commands()), std::nullopt);
        size_t barriers = 0;
        for (size_t i = 0; i < recording.commands().size(); ++i) {
            auto without = recording.commands();
            if (!without[i].barrier_before) continue;
            ++barriers;
            without[i].barrier_before = false;
            EXPECT_TRUE(unordered_pair(without).has_value()) << "before command " << i;
        }
        EXPECT_GT(barriers, 50u);
        EXPECT_LT(barriers, 150u);
    }
}

TEST(FrameHazards, EveryPairHasABarrierBetween) {
    std::vector<std::string> pipelines;
    for (const auto& commands : frames(pipelines)) {
        const auto pair = unordered_pair(commands);
        EXPECT_FALSE(pair.has_value()) << *pair;
    }
    // All shaders but those of densification and removal, which run between frames, of a window's pictures, of meshes, of
    // operators on arrays, and of the other kind of sort.
    const auto elsewhere = [](std::string_view name) {
        if (name.starts_with("radix_")) return name.ends_with("_ranked") != rig().config().ranked_sort;
        for (const char* other : {"contribute", "densify", "mcmc_", "pack", "trace_", "project_views",
                                  "harmonics", "collect_records", "gather_slots", "blend_absolute"})
            if (name.starts_with(other)) return true;
        return false;
    };
    for (const std::string_view name : passes::shader_names())
        EXPECT_TRUE(elsewhere(name) || std::ranges::find(pipelines, name) != pipelines.end()) << name;
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
