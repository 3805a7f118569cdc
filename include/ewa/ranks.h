// SPDX-License-Identifier: Apache-2.0
// The processes that train one scene together, and their messages. A process that runs alone is rank 0 of 1.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace ewa {

/// A group of processes. gather and exchange are collective: every rank calls them in the same order. Both throw RunError if a rank
/// does not answer within the time that the group was opened with. Ranks exchange copies and integers, but no sums of floats, so
/// results do not depend on the order of arrival.
class Ranks {
  public:
    virtual ~Ranks() = default;

    virtual int rank() const = 0;  // of this process, from 0
    virtual int size() const = 0;  // at least 1
    /// The name of a rank in messages: "rank 3 (node7)".
    virtual std::string name(int rank) const = 0;

    /// The values of all ranks, those of rank 0 first. Every rank gives the same number of values.
    virtual std::vector<uint64_t> gather(std::span<const uint64_t> own) = 0;
    /// Sends out[r] to rank r, and fills in[r] with what rank r sends to this one. Both have size() parts. A part may be
    /// empty. The sizes of a part at both ends agree.
    virtual void exchange(std::span<const std::span<const std::byte>> out,
                          std::span<const std::span<std::byte>> in) = 0;
    /// Ends all ranks with this exit status. The caller has printed the reason.
    [[noreturn]] virtual void end_all(int status) = 0;
};

/// The group of a process that trains alone: rank 0 of 1.
std::shared_ptr<Ranks> alone();

}  // namespace ewa
