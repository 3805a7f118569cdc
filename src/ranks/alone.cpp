// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "ewa/ranks.h"

namespace ewa {
namespace {

class Alone final : public Ranks {
  public:
    int rank() const override { return 0; }
    int size() const override { return 1; }
    std::string name(int /*rank*/) const override { return "rank 0"; }
    std::vector<uint64_t> gather(std::span<const uint64_t> own) override { return {own.begin(), own.end()}; }
    void exchange(std::span<const std::span<const std::byte>> out,
                  std::span<const std::span<std::byte>> in) override {
        if (!in[0].empty()) std::memmove(in[0].data(), out[0].data(), in[0].size());
    }
    void end_all(int status) override {
        std::fflush(nullptr);
        std::_Exit(status);
    }
};

}  // namespace

std::shared_ptr<Ranks> alone() {
    return std::make_shared<Alone>();
}

}  // namespace ewa
