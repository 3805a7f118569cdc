// SPDX-License-Identifier: Apache-2.0
// The process's default device, and the rules of its use from Python: no other thread waits for the interpreter meanwhile,
// one thread at a time uses the device, and no process inherits it by fork.
#pragma once
#include <nanobind/nanobind.h>

#include <memory>
#include <mutex>
#include <utility>

#include "ewa/device.h"

namespace ewa::python {

namespace nb = nanobind;

/// While it lives, the interpreter is free for other threads, and no other thread uses the device. Made by a thread that holds the
/// interpreter. No Python object may be touched meanwhile.
class DeviceWork {
  public:
    /// Throws RunError in a process that was forked after a device was opened: its driver's threads are missing there.
    DeviceWork();

    /// The default device, which the first call opens. Throws as open_device does, and where no Vulkan loader is installed.
    std::shared_ptr<gpu::Device> device() const;

  private:
    /// Counts, until the thread has the interpreter again.
    struct Presence {
        Presence();
        ~Presence();
    };
    /// Never returns in a thread that begins to use the device at the end of the process.
    void stay_while_python_ends();

    Presence presence_;
    nb::gil_scoped_release released_;
    std::unique_lock<std::recursive_mutex> lock_;
};

/// Whether a device was opened by the process that this one was forked from.
bool was_forked();

/// Runs Python's signal handlers. Throws what they raise, such as KeyboardInterrupt. For the middle of a DeviceWork.
void check_signals();

/// An object that has device memory. In a forked process it is left alone: freeing it would wait for threads that are missing.
template <class T>
class OnDevice {
  public:
    OnDevice() = default;
    explicit OnDevice(std::unique_ptr<T> object) : object_(std::move(object)) {}
    OnDevice(OnDevice&&) noexcept = default;
    OnDevice& operator=(OnDevice&& other) noexcept {
        free();
        object_ = std::move(other.object_);
        return *this;
    }
    ~OnDevice() { free(); }
    T* operator->() const { return object_.get(); }
    T& operator*() const { return *object_; }

  private:
    void free() {
        if (!object_) return;
        if (was_forked()) {
            (void)object_.release();
            return;
        }
        const DeviceWork work;
        object_.reset();
    }
    std::unique_ptr<T> object_;
};

}  // namespace ewa::python
