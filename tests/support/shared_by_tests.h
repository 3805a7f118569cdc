// SPDX-License-Identifier: Apache-2.0
// What all tests of a program share, made by the first that needs it and destroyed after the last.
#pragma once
#include <gtest/gtest.h>

#include <memory>

namespace ewa::test {

/// Destroys its value before main() returns. A static variable would destroy it in exit(), too late for a
/// Vulkan device: the validation layer (1.4.309 for one) registers an exit handler with every instance. The
/// handler frees the layer's state of all devices. It runs before the destructors of statics that were made
/// before the last instance.
template <class T>
class SharedByTests : public ::testing::Environment {
  public:
    /// GoogleTest owns what this returns. Call it before main(), as the initialiser of a global. What is
    /// added later is destroyed earlier.
    static SharedByTests* add() {
        auto* const added = new SharedByTests;
        ::testing::AddGlobalTestEnvironment(added);
        return added;
    }
    template <class Make>
    T& get(Make make) {
        if (!value_) value_.reset(new T(make()));
        return *value_;
    }
    void TearDown() override { value_.reset(); }

  private:
    std::unique_ptr<T> value_;
};

}  // namespace ewa::test
