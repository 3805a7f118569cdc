#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which options of which commands a test types."""
import collections, sys, unittest

sys.dont_write_bytecode = True
import check_options

CPP = """
const Words kLimit{"--device-memory", "1"};
class Fixture : public testing::Test {
    Outcome train(const std::string& out, const Words& more = {}) {
        Words words{"train", folder / out, "--steps", "4"};
        return run_ewa(words);
    }
};
TEST_F(Fixture, Helpers) {
    train("a", {"--batch", "2"});
    train("b", kLimit);
    const auto draw = [&](const Words& more) { return run_ewa(with({"render", folder / "a"}, more)); };
    draw({"--size", "8x8"});
    EXPECT_NE(run_ewa({"info", folder / "a"}).out.find("--shown"), std::string::npos);
    for (const char* option : {"--anyone", "--else"}) use(option);
}
TEST(Window, Alone) {
    for (const char* option : {"--mode"}) run_view({option, "--frame=3", "--no sentence of options"});
}
"""
SHELL = """
short() { ewa train data "$@"; }
row_a() {
    run 0 short -o out --keep 2
    run 0 ewa eval out \\
        --json x && ewa-view --verbose
}
"""
COMMANDS = ["train", "render", "info", "eval", "ewa-view"]


class Options(unittest.TestCase):
    def test_of_tests_in_cpp_count_for_the_command_that_gets_them(self):
        code = check_options.Code(COMMANDS)
        code.read(CPP, "")
        self.assertEqual({command: options for command, options in code.typed.items() if options}, {
            "train": {"--steps", "--batch", "--device-memory"}, "render": {"--size"}, "ewa-view": {"--mode", "--frame"}})

    def test_of_shell_scripts_count_for_the_command_of_the_line(self):
        typed = collections.defaultdict(set)
        check_options.read_shell(SHELL, COMMANDS, typed)
        self.assertEqual(dict(typed), {"train": {"-o", "--keep"}, "eval": {"--json"}, "ewa-view": {"--verbose"}})


if __name__ == "__main__":
    unittest.main()
