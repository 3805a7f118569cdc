// SPDX-License-Identifier: Apache-2.0
// One value that kernels write and the host reads after each submission.
#pragma once
#include <cstring>
#include <string>

#include "gpu/buffer.h"
#include "gpu/recording.h"

namespace ewa::gpu {

/// The value lies in device memory, since every invocation may use it. If the host cannot map that memory, record()
/// copies the value to host memory.
template <class T>
class ReadBack {
  public:
    ReadBack(Device& device, const std::string& name) : buffer_(device, name, sizeof(T)) {
        if (!buffer_.mapped()) copy_ = Buffer(device, name + " copy", sizeof(T), Texel::none, false, true);
    }
    const Buffer& buffer() const { return buffer_; }
    void clear(Recording& recording) const { recording.fill(buffer_, 0, 0, sizeof(T)); }
    /// Records the copy to host memory, if one is needed. Call it after all commands that write the value.
    void record(Recording& recording) const {
        if (copy_) recording.copy(buffer_, 0, copy_, 0, sizeof(T));
    }
    /// The value of the last submission with record().
    T read() const {
        T value;
        std::memcpy(&value, (copy_ ? copy_ : buffer_).mapped(), sizeof(T));
        return value;
    }

  private:
    Buffer buffer_, copy_;
};

}  // namespace ewa::gpu
