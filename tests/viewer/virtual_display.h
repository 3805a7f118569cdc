// SPDX-License-Identifier: Apache-2.0
// An X server without a screen, for as long as one of these lives.
#pragma once
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <poll.h>

#include <cstdlib>
#include <string>

namespace ewa::test {

class VirtualDisplay {
  public:
    VirtualDisplay() {
        int ends[2];
        if (pipe(ends) != 0) return;
        server_ = fork();
        if (server_ == 0) {
            close(ends[0]);
            const std::string end = std::to_string(ends[1]);
            if (!freopen("/dev/null", "w", stderr)) _exit(127);
            execlp("Xvfb", "Xvfb", "-displayfd", end.c_str(), "-screen", "0", "1280x1024x24", "-nolisten",
                   "tcp", nullptr);
            _exit(127);
        }
        close(ends[1]);
        number_ = server_ > 0 ? line_from(ends[0]) : "";
        close(ends[0]);
    }
    ~VirtualDisplay() {
        if (server_ <= 0) return;
        kill(server_, SIGTERM);
        waitpid(server_, nullptr, 0);
    }
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;

    /// Empty where no server could be started; else what DISPLAY is set to.
    std::string name() const { return number_.empty() ? "" : ":" + number_; }

  private:
    static std::string line_from(int descriptor) {
        constexpr int kPatience = 20000;  // ms
        std::string line;
        for (char c = 0; c != '\n';) {
            pollfd waiting{descriptor, POLLIN, 0};
            if (poll(&waiting, 1, kPatience) != 1 || read(descriptor, &c, 1) != 1) return "";
            if (c != '\n') line += c;
        }
        return line;
    }

    pid_t server_ = -1;
    std::string number_;
};

}  // namespace ewa::test
