// SPDX-License-Identifier: Apache-2.0
// Loaded in front of the system's libraries (LD_PRELOAD), so that a program meets faults at chosen moments:
//   EWA_FAULT_ALLOCATIONS=N  from the N-th on, there is no memory for a buffer or a block of device memory
//   EWA_FAULT_BLOCKS=N       from the N-th on, the driver allows no further block of device memory
//   EWA_FAULT_HEAP=N         from the N-th submission on, there is no host memory for an array of 1 KiB or more
//   EWA_FAULT_SUBMITS=N      the N-th submission and those after it find the device lost
//   EWA_FAULT_WAITS=N        the same of waiting for one
//   EWA_FAULT_ACQUIRE=N,R    the N-th picture of a window cannot be had: the VkResult R
//   EWA_FAULT_PRESENT=N,R    the N-th picture of a window is shown with the VkResult R
//   EWA_FAULT_BYTES=N        the disk is full once N bytes have been written to regular files
//   EWA_FAULT_ROOM=N         every disk says that it has N bytes free
//   EWA_FAULT_FSYNC=N        from the N-th on, regular files cannot be brought to the disk: a quota's end
//   EWA_FAULT_CLOSE=N        the same of closing a regular file that has been written
//   EWA_FAULT_READ_ONLY=DIR  nothing below DIR can be created, changed or removed
//   EWA_FAULT_KILL=N         the program is killed at the N-th submission, file opened for writing, write
//                            (half of it done), renaming or removal, whichever it is
//   EWA_FAULT_SIGNAL=N,S     the signal S arrives at the N-th submission or opening, writing, renaming or
//                            removal of a file of core/atomic_file.h, and at each one after it
//   EWA_FAULT_HOLD=N:FILE    the N-th submission makes FILE and waits until it is gone: the test does in
//                            between what it likes
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <vulkan/vulkan.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>

namespace {

using FindSymbol = void* (*)(void*, const char*);

/// The function of the system, in whose place this library has one.
FindSymbol system_dlsym() {
    // The versions of glibc 2.34 and of those before it.
    static const auto found = [] {
        void* symbol = dlvsym(RTLD_NEXT, "dlsym", "GLIBC_2.34");
        return reinterpret_cast<FindSymbol>(symbol ? symbol : dlvsym(RTLD_NEXT, "dlsym", "GLIBC_2.2.5"));
    }();
    return found;
}

template <class Function>
Function next(const char* name) {
    return reinterpret_cast<Function>(system_dlsym()(RTLD_NEXT, name));
}

bool is_of_this_library(void* symbol) {
    Dl_info its{}, own{};
    return dladdr(symbol, &its) && dladdr(reinterpret_cast<void*>(&is_of_this_library), &own) &&
           its.dli_fbase == own.dli_fbase;
}

/// Whether this call of those that `variable` counts is to fail.
bool due(const char* variable, std::atomic<long>& calls) {
    const char* from = std::getenv(variable);
    return from && ++calls >= std::atol(from);
}

int second_number(const char* variable) {
    const char* comma = std::strchr(std::getenv(variable), ',');
    if (!comma) std::abort();
    return int(std::atol(comma + 1));
}

bool out_of_memory() {
    static std::atomic<long> calls{0};
    return due("EWA_FAULT_ALLOCATIONS", calls);
}

/// The result that this call of those that `variable` counts is to have, or the one it has.
VkResult instead(const char* variable, std::atomic<long>& calls, VkResult result) {
    const char* from = std::getenv(variable);
    if (!from || ++calls != std::atol(from)) return result;
    return VkResult(second_number(variable));
}

bool read_only(const char* path) {
    const char* folder = std::getenv("EWA_FAULT_READ_ONLY");
    if (!folder || !path) return false;
    const size_t length = std::strlen(folder);
    return std::strncmp(path, folder, length) == 0 && (path[length] == '/' || path[length] == 0);
}

int refuse() {
    errno = EROFS;
    return -1;
}

/// One more of the moments that EWA_FAULT_KILL counts; whether it ends the program. own: it is none of the
/// driver's, whose number is not the program's to know, and EWA_FAULT_SIGNAL counts it too.
bool last_moment(bool own) {
    static std::atomic<long> calls{0}, signals{0};
    if (own && due("EWA_FAULT_SIGNAL", signals)) raise(second_number("EWA_FAULT_SIGNAL"));
    return due("EWA_FAULT_KILL", calls);
}

/// The temporary that was opened last.
std::atomic<int> temporary{-1};

bool names_temporary(const char* path) {
    const char* slash = std::strrchr(path, '/');
    return std::strncmp(slash ? slash + 1 : path, ".ewa-", 5) == 0;
}

bool regular(int file, bool written) {
    struct stat status {};
    return fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
           (!written || (fcntl(file, F_GETFL) & O_ACCMODE) != O_RDONLY);
}

void die() {
    kill(getpid(), SIGKILL);
}

/// Whether EWA_FAULT_HEAP has begun.
std::atomic<bool> heap_is_full{false};

/// Waits at the submission that EWA_FAULT_HOLD names; no longer than its parent lives.
void hold() {
    static std::atomic<long> calls{0};
    const char* from = std::getenv("EWA_FAULT_HOLD");
    const char* colon = from ? std::strchr(from, ':') : nullptr;
    if (!colon || ++calls != std::atol(from)) return;
    const pid_t parent = getppid();
    std::FILE* file = std::fopen(colon + 1, "w");
    if (!file) std::abort();
    std::fputs("held", file);
    std::fclose(file);
    while (access(colon + 1, F_OK) == 0 && getppid() == parent) usleep(1000);
}

}  // namespace

/// The threads of drivers and libraries keep their memory.
void* operator new(std::size_t size) {
    constexpr std::size_t kSmall = 1024;
    const bool refused = heap_is_full && size >= kSmall && getpid() == gettid();
    void* memory = refused ? nullptr : std::malloc(size);
    if (!memory) throw std::bad_alloc();
    return memory;
}

extern "C" {

/// Programs load Vulkan at run time, and find this library's functions before the loader's.
void* dlsym(void* library, const char* name) {
    if (library != RTLD_NEXT && name[0] == 'v' && name[1] == 'k') {
        void* own = system_dlsym()(RTLD_DEFAULT, name);
        if (own && is_of_this_library(own)) return own;
    }
    return system_dlsym()(library, name);
}

VkResult vkAllocateMemory(VkDevice device, const VkMemoryAllocateInfo* info,
                          const VkAllocationCallbacks* callbacks, VkDeviceMemory* memory) {
    static std::atomic<long> calls{0};
    if (due("EWA_FAULT_BLOCKS", calls)) return VK_ERROR_TOO_MANY_OBJECTS;
    if (out_of_memory()) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    return next<PFN_vkAllocateMemory>("vkAllocateMemory")(device, info, callbacks, memory);
}

VkResult vkCreateBuffer(VkDevice device, const VkBufferCreateInfo* info,
                        const VkAllocationCallbacks* callbacks, VkBuffer* buffer) {
    if (out_of_memory()) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    return next<PFN_vkCreateBuffer>("vkCreateBuffer")(device, info, callbacks, buffer);
}

VkResult vkQueueSubmit(VkQueue queue, uint32_t count, const VkSubmitInfo* submits, VkFence fence) {
    static std::atomic<long> calls{0}, heap_calls{0};
    if (due("EWA_FAULT_SUBMITS", calls)) return VK_ERROR_DEVICE_LOST;
    if (due("EWA_FAULT_HEAP", heap_calls)) heap_is_full = true;
    if (last_moment(true)) die();
    hold();
    return next<PFN_vkQueueSubmit>("vkQueueSubmit")(queue, count, submits, fence);
}

VkResult vkWaitForFences(VkDevice device, uint32_t count, const VkFence* fences, VkBool32 all,
                         uint64_t timeout) {
    static std::atomic<long> calls{0};
    // The driver here is not lost in truth, and works on: what it works with may go only once it has ended.
    const VkResult result = next<PFN_vkWaitForFences>("vkWaitForFences")(device, count, fences, all, timeout);
    return due("EWA_FAULT_WAITS", calls) ? VK_ERROR_DEVICE_LOST : result;
}

VkResult vkAcquireNextImageKHR(VkDevice device, VkSwapchainKHR swapchain, uint64_t timeout,
                               VkSemaphore semaphore, VkFence fence, uint32_t* index) {
    static std::atomic<long> calls{0};
    // Nothing is acquired where it fails.
    const VkResult result = instead("EWA_FAULT_ACQUIRE", calls, VK_SUCCESS);
    if (result != VK_SUCCESS) return result;
    return next<PFN_vkAcquireNextImageKHR>("vkAcquireNextImageKHR")(device, swapchain, timeout, semaphore,
                                                                    fence, index);
}

VkResult vkQueuePresentKHR(VkQueue queue, const VkPresentInfoKHR* info) {
    static std::atomic<long> calls{0};
    return instead("EWA_FAULT_PRESENT", calls, next<PFN_vkQueuePresentKHR>("vkQueuePresentKHR")(queue, info));
}

ssize_t write(int file, const void* bytes, size_t count) {
    static std::atomic<long> written{0};
    const auto real = next<ssize_t (*)(int, const void*, size_t)>("write");
    if (file <= 2 || !regular(file, true)) return real(file, bytes, count);
    if (last_moment(file == temporary)) {
        (void)!real(file, bytes, count / 2);
        die();
    }
    const char* room = std::getenv("EWA_FAULT_BYTES");
    if (!room) return real(file, bytes, count);
    const long left = std::atol(room) - written;
    if (left <= 0) {
        errno = ENOSPC;
        return -1;
    }
    const ssize_t done = real(file, bytes, count < size_t(left) ? count : size_t(left));
    if (done > 0) written += done;
    return done;
}

int open(const char* path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    const mode_t mode = flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    const bool writing = (flags & (O_WRONLY | O_RDWR | O_CREAT)) != 0 && std::strcmp(path, "/dev/null") != 0;
    if (writing && read_only(path)) return refuse();
    const bool own = writing && names_temporary(path);
    if (writing && last_moment(own)) die();
    const int file = next<int (*)(const char*, int, ...)>("open")(path, flags, mode);
    if (own) temporary = file;
    return file;
}

int statvfs(const char* path, struct statvfs* disk) {
    const int result = next<int (*)(const char*, struct statvfs*)>("statvfs")(path, disk);
    if (const char* room = std::getenv("EWA_FAULT_ROOM"); room && result == 0)
        disk->f_bavail = fsblkcnt_t(std::atol(room)) / disk->f_frsize;
    return result;
}

int fsync(int file) {
    static std::atomic<long> calls{0};
    if (regular(file, true) && due("EWA_FAULT_FSYNC", calls)) {
        errno = EDQUOT;
        return -1;
    }
    return next<int (*)(int)>("fsync")(file);
}

int close(int file) {
    static std::atomic<long> calls{0};
    const bool full = std::getenv("EWA_FAULT_CLOSE") && regular(file, true) && due("EWA_FAULT_CLOSE", calls);
    const int result = next<int (*)(int)>("close")(file);
    if (!full || result != 0) return result;
    errno = EDQUOT;
    return -1;
}

int rename(const char* from, const char* to) {
    if (read_only(from) || read_only(to)) return refuse();
    if (last_moment(names_temporary(from))) die();
    return next<int (*)(const char*, const char*)>("rename")(from, to);
}

int unlink(const char* path) {
    if (read_only(path)) return refuse();
    if (last_moment(names_temporary(path))) die();
    return next<int (*)(const char*)>("unlink")(path);
}
}
