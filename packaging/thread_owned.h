// SPDX-License-Identifier: Apache-2.0
// boost::thread_specific_ptr as far as OpenImageIO uses it: a pointer of which each thread has its own. Values of other threads live
// until these end.
#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <unordered_map>

template <typename T>
class thread_specific_ptr {
  public:
    thread_specific_ptr() : thread_specific_ptr([](T* value) { delete value; }) {}
    /// clean: called with a value that is replaced, or whose thread ends.
    explicit thread_specific_ptr(void (*clean)(T*)) : clean_(clean) {}
    thread_specific_ptr(const thread_specific_ptr&) = delete;
    thread_specific_ptr& operator=(const thread_specific_ptr&) = delete;
    ~thread_specific_ptr() { reset(); }
    T* get() const {
        const auto found = values().find(id_);
        return found == values().end() ? nullptr : found->second.get();
    }
    T& operator*() const { return *get(); }
    T* operator->() const { return get(); }
    void reset(T* value = nullptr) {
        if (value && get() == value) return;
        values().erase(id_);
        if (value) values().emplace(id_, Value(value, clean_));
    }

  private:
    using Value = std::unique_ptr<T, void (*)(T*)>;
    static std::unordered_map<std::uint64_t, Value>& values() {
        thread_local std::unordered_map<std::uint64_t, Value> values;
        return values;
    }
    static std::uint64_t next() {
        static std::atomic<std::uint64_t> last{0};
        return ++last;
    }
    const std::uint64_t id_ = next();  // an address would come back
    void (*const clean_)(T*);
};
