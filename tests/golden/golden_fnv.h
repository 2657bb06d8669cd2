/* golden_fnv - FNV-1a, 64 bits, over numbers: each as its value, least significant byte first, so that
 * neither padding nor the processor's byte order matter. */
#ifndef GOLDEN_FNV_H
#define GOLDEN_FNV_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define GOLDEN_FNV_START 0xcbf29ce484222325u
#define GOLDEN_FNV_PRIME 0x100000001b3u

static inline uint64_t golden_add(uint64_t hash, int64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) {
        hash = (hash ^ (((uint64_t)value >> (8 * i)) & 0xff)) * GOLDEN_FNV_PRIME;
    }
    return hash;
}

static inline uint64_t golden_add_word(uint64_t hash, int32_t value)
{
    return golden_add(hash, value, 4);
}

/* An array of 32-bit integers, or a struct that has no other members. */
static inline uint64_t golden_add_words(uint64_t hash, const void *first, size_t size)
{
    for (size_t at = 0; at < size; at += sizeof(int32_t)) {
        int32_t value = 0;
        memcpy(&value, (const char *)first + at, sizeof value);
        hash = golden_add_word(hash, value);
    }
    return hash;
}

#endif
