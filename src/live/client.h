// SPDX-License-Identifier: Apache-2.0
// The watcher's side of protocol.h.
#pragma once
#include <string>

#include "live/protocol.h"
#include "live/socket.h"

namespace ewa::live {

class Client {
  public:
    /// Connects, and makes sure that a training of ewa answers. token: empty for looking on only. stop: as
    /// Socket has it. Throws RunError, InputError.
    Client(const Address& address, const std::string& token, const std::atomic<bool>* stop = nullptr);

    // Each throws InputError for a refusal or an answer that is none, RunError where the connection is gone.
    Status status(size_t first_line);
    /// Splats later than `step`; nothing where there are none yet.
    std::optional<Snapshot> splats(int step);
    void command(const std::string& name);

  private:
    std::vector<std::byte> ask(const std::string& request);

    Socket socket_;
    std::string who_;
};

}  // namespace ewa::live
