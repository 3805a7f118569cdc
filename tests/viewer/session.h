// SPDX-License-Identifier: Apache-2.0
// ewa-view in a window that is driven by the X server's own key and mouse events (xdotool, by XTEST), and
// that another client of the server looks at and drops files on.
#pragma once
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "support/soon.h"
#include "viewer/window_test.h"
#include "viewer/x_client.h"

namespace ewa::test {

inline bool have_xdotool() {
    return std::system("command -v xdotool > /dev/null 2>&1") == 0;
}

inline constexpr double kSessionPatience = 180;  // seconds; only a machine with no time to spare needs them

class Session {
  public:
    /// Starts it in `folder`, where it leaves its screenshots, and waits for its window.
    Session(const std::string& folder, std::vector<std::string> arguments,
            const std::vector<std::pair<std::string, std::string>>& environment = {})
        : folder_(folder) {
        child_ = fork();
        if (child_ == 0) {
            for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
            if (chdir(folder.c_str()) != 0) _exit(127);
            dup2(open("out.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
            dup2(open("err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
            arguments.insert(arguments.begin(), EWA_VIEW_PROGRAM);
            std::vector<char*> argv;
            for (std::string& argument : arguments) argv.push_back(argument.data());
            argv.push_back(nullptr);
            execv(EWA_VIEW_PROGRAM, argv.data());
            _exit(127);
        }
        found_ = send("search --sync --onlyvisible --name ewa$ windowmove 0 0");
        send("mousemove 20 20");
    }
    ~Session() {
        if (child_ <= 0) return;
        kill(child_, SIGKILL);
        waitpid(child_, nullptr, 0);
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    bool found() const { return found_; }

    /// Whether it has ended by itself, or by a fault.
    bool ended() const {
        siginfo_t info{};
        return waitid(P_PID, id_t(child_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == child_;
    }

    /// Commands of xdotool, such as "key F1 mousemove 10 20 click 1".
    bool send(const std::string& commands) {
        return std::system(("timeout 60 xdotool " + commands + " > /dev/null 2>&1").c_str()) == 0;
    }
    /// From a file of such commands, one a line.
    bool send_file(const std::string& path) {
        return std::system(("timeout 300 xdotool " + path + " > /dev/null 2>&1").c_str()) == 0;
    }

    /// Asks for a screenshot, and the path of what was written; empty where nothing is.
    std::string screenshot(const std::string& extension = ".png") {
        const std::string path =
            folder_ + "/ewa-view-" + std::to_string(extension == ".png" ? ++png_ : ++exr_) + extension;
        send(extension == ".png" ? "key F12" : "key shift+F12");
        return awaited(path) ? path : "";
    }
    bool awaited(const std::string& path) const {
        bool there = false;  // a file is whole when it has its name
        soon([&] { return (there = std::filesystem::exists(path)) || ended(); }, kSessionPatience);
        return there;
    }

    /// Ctrl-Q; its exit status, and what it has said.
    Outcome quit() {
        send("key ctrl+q");
        int status = 0;
        pid_t ended = 0;
        soon([&] { return (ended = waitpid(child_, &status, WNOHANG)) != 0; }, kSessionPatience);
        Outcome outcome;  // its status is -1 where it has not ended
        if (ended == child_)
            outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        outcome.out = read_file(folder_ + "/out.txt");
        outcome.err = read_file(folder_ + "/err.txt");
        if (ended == child_) child_ = -1;  // else the destructor ends it
        return outcome;
    }

  private:
    std::string folder_;
    pid_t child_ = -1;
    bool found_ = false;
    int png_ = 0, exr_ = 0;
};

/// A window with 400 splats, driven.
class SessionTest : public WindowTest {
  protected:
    void SetUp() override {
        WindowTest::SetUp();
        if (IsSkipped()) return;
        if (!have_xdotool())
            GTEST_SKIP()
                << "there is no xdotool (Debian: xdotool) to press keys with; the input is not tested";
        std::filesystem::create_directories(shots_);
    }
    /// Sends the commands one by one, each after a frame that has seen the one before.
    static void act(Session& session, const std::vector<std::string>& commands) {
        for (const std::string& command : commands) {
            session.send(command);
            screenshot(session);
        }
    }
    static Image screenshot(Session& session) {
        const std::string path = session.screenshot();
        EXPECT_NE(path, "") << "no screenshot was written";
        return path.empty() ? Image(1, 1, 3) : load_image(path);
    }
    const std::string shots_ = folder_ / "shots";
};

}  // namespace ewa::test
