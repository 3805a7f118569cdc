// SPDX-License-Identifier: Apache-2.0
// ewa convert with a selection, and with a journal of edits.
#include "cli/expect.h"
#include "ewa/splat_files.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

class ConvertSelection : public testing::Test {
  protected:
    void SetUp() override { make_splats(splats_, 200, 1); }
    Gaussians converted(const std::vector<std::string>& edits) {
        std::vector<std::string> arguments{"convert", splats_, out_, "--quiet"};
        arguments.insert(arguments.end(), edits.begin(), edits.end());
        expect_success(run_ewa(arguments));
        return read_splats(out_).gaussians;
    }
    Folder folder_;
    const std::string splats_ = folder_ / "splats.ply", out_ = folder_ / "out.ply";
};

TEST_F(ConvertSelection, ChangesTheSelectedSplatsAlone) {
    const Gaussians before = read_splats(splats_).gaussians;
    const Gaussians moved = converted({"--select", "x=0..", "--transform", "move=0,0,7"});
    ASSERT_EQ(moved.size(), before.size());
    size_t far = 0, near_and_low = 0;
    for (size_t i = 0; i < before.size(); ++i) {
        const bool selected = before.means[3 * i] >= 0;
        far += selected;
        near_and_low += !selected && before.means[3 * i + 1] < 0;
        EXPECT_EQ(moved.means[3 * i + 2],
                  selected ? float(double(before.means[3 * i + 2]) + 7) : before.means[3 * i + 2]);
    }
    EXPECT_GT(far, 10u);
    EXPECT_EQ(converted({"--select", "x=0..", "--delete"}).size(), before.size() - far);
    EXPECT_EQ(converted({"--remove", "x=0.."}).size(), before.size() - far);
    EXPECT_EQ(converted({"--select", "x=0..", "--remove", "y=0..", "--delete"}).size(), near_and_low);
    EXPECT_EQ(converted({"--select", "x=0..", "--duplicate"}).size(), before.size() + far);
    EXPECT_EQ(converted({"--select", "x=0..", "--lock", "--select", "all", "--delete", "--unlock"}).size(),
              far);
    EXPECT_EQ(converted({"--select", "x=0..", "--hide", "--select", "all", "--delete", "--unhide"}).size(),
              far);
    EXPECT_EQ(converted({"--select", "x=0..", "--adjust", "tint=0,1,1;opacity=0.5", "--reset"}).sh,
              before.sh);
    EXPECT_NE(converted({"--select", "x=0..", "--adjust", "tint=0,1,1;opacity=0.5"}).sh, before.sh);
}

TEST_F(ConvertSelection, WarnsWhereNothingIsSelected) {
    const auto warned = [&](const std::vector<std::string>& edits) {
        std::vector<std::string> arguments{"convert", splats_, out_, "--quiet"};
        arguments.insert(arguments.end(), edits.begin(), edits.end());
        const Outcome outcome = run_ewa(arguments);
        EXPECT_EQ(outcome.status, 0);
        EXPECT_EQ(read_splats(out_).gaussians.size(), 200u);
        return outcome.err;
    };
    EXPECT_EQ(warned({"--remove", "x=900.."}), "");
    EXPECT_EQ(warned({"--delete"}), "warning: --delete changed nothing: no splat is selected\n");
    EXPECT_EQ(warned({"--select", "x=900..", "--transform", "move=1,0,0"}),
              "warning: --select x=900.. selects no splat\n"
              "warning: --transform changed nothing: no splat is selected\n");
    EXPECT_EQ(warned({"--select", "all", "--lock", "--unlock", "--select", "none"}), "");
}

TEST_F(ConvertSelection, ReplaysAJournal) {
    const std::string journal = folder_ / "splats.ply.edits";
    write_file(journal,
               "{\"ewa_edits\":1,\"file\":\"splats.ply\",\"splats\":200}\n"
               "{\"step\":\"Select\",\"edits\":[[\"select\",\"x=0..\"]]}\n"
               "{\"step\":\"Delete\",\"edits\":[[\"delete\"]]}\n"
               "{\"undo\":1}\n"
               "{\"step\":\"Tint\",\"edits\":[[\"adjust\",\"tint=0,1,1\"]]}\n");
    const Gaussians replayed = converted({"--edits", journal});
    EXPECT_EQ(replayed.sh, converted({"--select", "x=0..", "--adjust", "tint=0,1,1"}).sh);
    EXPECT_EQ(replayed.size(), 200u);
    write_file(journal, "{\"ewa_edits\":1,\"file\":\"splats.ply\",\"splats\":200}\n{\"redo\":1}\n");
    expect_failure(run_ewa({"convert", splats_, out_, "--edits", journal}), 2,
                   "line 2: there is nothing to redo");
    write_file(journal,
               "{\"ewa_edits\":1,\"file\":\"splats.ply\",\"splats\":7}\n"
               "{\"step\":\"Select\",\"edits\":[[\"select\",\"x=0..\"]]}\n{\"saved\":1}\n\n{\"undo\":");
    const Outcome replay = run_ewa({"convert", splats_, out_, "--edits", journal});
    expect_success(replay);
    EXPECT_NE(replay.out.find("edits were made on 7 splats, and the scene has 200"), std::string::npos);
    EXPECT_NE(replay.out.find("is cut off and skipped"), std::string::npos);
}

TEST_F(ConvertSelection, NamesTheShapeThatItCannotRead) {
    expect_failure(run_ewa({"convert", splats_, out_, "--select", "everything"}), 2,
                   "--select: 'everything' is not all");
    expect_failure(run_ewa({"convert", splats_, out_, "--select", "flood=0,0,0,-1"}), 2,
                   "--select: 'flood=0,0,0,-1' is not flood=x,y,z,T");
    expect_failure(
        run_ewa({"convert", splats_, out_, "--select", "brush=1e308,0,0;view=1,1,0,0,1,0,0,0,0,0,0;front"}),
        2, "--select: 'brush=1e308,0,0' is not brush=R");
    expect_failure(run_ewa({"convert", splats_, out_, "--select", "all", "--transform", "scale=0"}), 2,
                   "--transform: the transform flattens");
    expect_failure(run_ewa({"convert", splats_, out_, "--select", "all", "--adjust", "glow=2"}), 2,
                   "--adjust: 'glow=2'");
}

}  // namespace
}  // namespace ewa::test
