/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Signatures: one number for what a product was made from. Any thread. */
#ifndef BRUME_BASE_HASH_H
#define BRUME_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

#define HASH_START 0xcbf29ce484222325ull

/* FNV-1a over the bytes; never 0, which stands for no product. */
static inline uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t count)
{
    const unsigned char *byte = bytes;
    for (size_t i = 0; i < count; ++i) {
        hash ^= byte[i];
        hash *= 0x100000001b3ull;
    }
    return hash ? hash : 1;
}

#endif
