// SPDX-License-Identifier: Apache-2.0
// Pipelines of a CPU device are compiled on threads, and each once.
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "gpu/compile_threads.h"
#include "gpu/guarded.h"
#include "gpu/test_device.h"
#include "passes/passes.h"

namespace ewa::test {
namespace {

TEST(CompileThreads, TakeLargerWorkFirst) {
    std::promise<void> held, began, done;
    std::vector<int> order;
    gpu::CompileThreads threads(1);
    threads.add(1, [&] {
        began.set_value();
        held.get_future().wait();
    });
    began.get_future().wait();
    for (const int size : {2, 5, 3, 4})
        threads.add(size_t(size), [&, size] {
            order.push_back(size);
            if (size == 2) done.set_value();
        });
    held.set_value();
    done.get_future().wait();
    EXPECT_EQ(order, (std::vector<int>{5, 4, 3, 2}));
}

TEST(CompileThreads, WorkAtOnceOnAsManyAsTheyMay) {
    // Each waits for the other.
    std::promise<void> first, second, done;
    gpu::CompileThreads threads(2);
    threads.add(1, [&] {
        first.set_value();
        second.get_future().wait();
        done.set_value();
    });
    threads.add(1, [&] {
        first.get_future().wait();
        second.set_value();
    });
    done.get_future().wait();
}

TEST(CompileThreads, EndWithoutWhatNoneHasBegun) {
    std::promise<void> began;
    bool later = false;
    auto other = std::make_shared<int>();
    const std::weak_ptr<int> waiting = other;
    std::optional<gpu::CompileThreads> threads(std::in_place, 1);
    threads->add(2, [&] {
        began.set_value();
        while (!waiting.expired()) std::this_thread::yield();  // the other work is there
    });
    began.get_future().wait();
    threads->add(1, [&later, kept = std::move(other)] { later = true; });
    threads.reset();
    EXPECT_FALSE(later);
}

TEST(CompileThreads, PipelinesAreThereForAllWhoAsk) {
    const std::shared_ptr<gpu::Device> own = open_test_device(true);
    const gpu::Pipeline* pipeline = nullptr;
    {
        passes::PassCache cache(*own);
        pipeline = &cache.get<passes::Reduce>().pipeline;
        cache.get<passes::LossRows>();
    }
    const auto handle = [&] { return pipeline->handle(); };
    std::future<vk::Pipeline> other = std::async(std::launch::async, handle);
    EXPECT_EQ(handle(), other.get());
    EXPECT_TRUE(handle());
    // What nobody waits for ends with the device.
}

}  // namespace
}  // namespace ewa::test
