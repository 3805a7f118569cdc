// SPDX-License-Identifier: Apache-2.0
// Functions of glibc 2.29 and later that GCC 12's libraries call. packaging/toolchain compiles each PART into an object of its own,
// in the part of libc that every program links. They are hidden: no library of a program shows them.
#define _GNU_SOURCE
#include <errno.h>
#include <link.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/random.h>
#include <time.h>

#pragma GCC visibility push(hidden)

#if PART == 1
// glibc 2.32. Zero: the program may have several threads, so reference counts are atomic.
char __libc_single_threaded = 0;

#elif PART == 2
// glibc 2.36, for std::random_device.
uint32_t arc4random(void) {
    uint32_t word;
    while (getrandom(&word, sizeof word, 0) != sizeof word)
        if (errno != EINTR) abort();
    return word;
}

#elif PART == 3
// glibc 2.35: where the unwinder finds the frames of an address. The layout is that of <dlfcn.h> on x86-64 and AArch64.
struct dl_find_object {
    unsigned long long flags;
    void *map_start, *map_end;
    struct link_map* link_map;
    void* eh_frame;
    unsigned long long reserved[7];
};
struct search {
    uintptr_t address;
    struct dl_find_object* found;
};

static int look(struct dl_phdr_info* object, size_t size, void* data) {
    (void)size;
    struct search* search = data;
    uintptr_t first = UINTPTR_MAX, last = 0;
    void* frames = NULL;
    int inside = 0;
    for (int i = 0; i < object->dlpi_phnum; ++i) {
        const ElfW(Phdr)* part = &object->dlpi_phdr[i];
        const uintptr_t begin = object->dlpi_addr + part->p_vaddr, end = begin + part->p_memsz;
        if (part->p_type == PT_GNU_EH_FRAME) frames = (void*)begin;
        if (part->p_type != PT_LOAD) continue;
        if (search->address >= begin && search->address < end) inside = 1;
        if (begin < first) first = begin;
        if (end > last) last = end;
    }
    if (!inside || !frames) return 0;
    *search->found = (struct dl_find_object){0, (void*)first, (void*)last, NULL, frames, {0}};
    return 1;
}

int _dl_find_object(void* address, struct dl_find_object* result) {
    struct search search = {(uintptr_t)address, result};
    return dl_iterate_phdr(look, &search) == 1 ? 0 : -1;
}

#else
// glibc 2.30: waits by the steady clock. Here by the time of day, from the time that is left.
static struct timespec time_of_day(clockid_t clock, const struct timespec* until) {
    struct timespec now, day;
    clock_gettime(clock, &now);
    clock_gettime(CLOCK_REALTIME, &day);
    day.tv_sec += until->tv_sec - now.tv_sec;
    day.tv_nsec += until->tv_nsec - now.tv_nsec;
    if (day.tv_nsec < 0) day.tv_sec -= 1, day.tv_nsec += 1000000000;
    if (day.tv_nsec >= 1000000000) day.tv_sec += 1, day.tv_nsec -= 1000000000;
    return day;
}

#if PART == 4
int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock, const struct timespec* until) {
    const struct timespec day = time_of_day(clock, until);
    return pthread_cond_timedwait(condition, mutex, &day);
}
#elif PART == 5
int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock, const struct timespec* until) {
    const struct timespec day = time_of_day(clock, until);
    return pthread_mutex_timedlock(mutex, &day);
}
#elif PART == 6
int pthread_rwlock_clockrdlock(pthread_rwlock_t* lock, clockid_t clock, const struct timespec* until) {
    const struct timespec day = time_of_day(clock, until);
    return pthread_rwlock_timedrdlock(lock, &day);
}
#elif PART == 7
int pthread_rwlock_clockwrlock(pthread_rwlock_t* lock, clockid_t clock, const struct timespec* until) {
    const struct timespec day = time_of_day(clock, until);
    return pthread_rwlock_timedwrlock(lock, &day);
}
#endif
#endif
