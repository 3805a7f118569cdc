// SPDX-License-Identifier: Apache-2.0
// What the tests of live have in common.
#pragma once
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "ewa/error.h"
#include "live/server.h"
#include "live/watcher.h"

namespace ewa::live {

inline Gaussians some_splats(size_t count, int degree = 1) {
    Gaussians splats;
    splats.sh_degree = degree;
    splats.resize(count);
    float value = 0.5f;
    for (auto* values :
         {&splats.means, &splats.quaternions, &splats.log_scales, &splats.opacity_logits, &splats.sh})
        for (float& v : *values) v = value += 0.25f;
    return splats;
}

inline report::MetricsLine line_of(int step) {
    report::MetricsLine line;
    line.step = step;
    line.loss = 1.0 / step;
    line.splats = 10;
    if (step % 2 == 0) line.test_psnr = 20 + step;
    return line;
}

/// Step `step` of 10, running.
inline Status status_at(int step, int steps = 10) {
    return {.step = step, .steps = steps, .splats = 5, .loss = 0.25, .seconds = 1.5};
}

inline Client client_of(const Server& server, const std::string& token = "") {
    return Client({"127.0.0.1", server.port()}, token);
}

/// Takes a server's edits on a thread of its own, as a training does after step 7.
class Editing {
  public:
    explicit Editing(Server& server)
        : thread_([this, &server] {
              while (!stop_) {
                  server.perform_edits([this](const std::string& body) {
                      last = body;
                      if (body == "bad") throw InputError("--dance\nis no edit");
                      return EditReply{7, 90, {10, 3, 1}};
                  });
                  std::this_thread::sleep_for(std::chrono::milliseconds(5));
              }
          }) {}
    ~Editing() {
        stop_ = true;
        thread_.join();
    }
    Editing(const Editing&) = delete;
    Editing& operator=(const Editing&) = delete;

    std::string last;  // body; read it after its answer has come

  private:
    std::atomic<bool> stop_ = false;
    std::thread thread_;
};

/// Until it holds, at most a minute.
template <class Holds>
bool soon(Holds holds) {
    for (int i = 0; i < 6000; ++i) {
        if (holds()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

}  // namespace ewa::live
