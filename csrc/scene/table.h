/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Datablocks by key: immutable, reference-counted, sorted by key. The owner locks. */
#ifndef BRUME_SCENE_TABLE_H
#define BRUME_SCENE_TABLE_H

#include "brume.h"

/* First member of every datablock. */
struct block {
    int references; /* atomic access only */
    void (*destroy)(struct block *block);
};

struct entry {
    uint64_t key;
    uint64_t revision; /* of the last set */
    struct block *block;
};

struct table {
    struct entry *entries;
    uint32_t count, capacity;
    uint64_t revision; /* of the last change of any kind */
};

void block_init(struct block *block, void (*destroy)(struct block *));
struct block *block_retain(struct block *block);
void block_release(struct block *block); /* NULL is fine */

/* Takes over the caller's reference, also on failure. */
brume_result table_set(struct table *table, uint64_t key, uint64_t revision, struct block *block);
void table_remove(struct table *table, uint64_t key, uint64_t revision);
brume_result table_keep(struct table *table, const uint64_t *keys, uint64_t count,
                        uint64_t revision);
const struct entry *table_find(const struct table *table, uint64_t key); /* NULL: not there */
/* A copy that holds references of its own. */
brume_result table_snapshot(const struct table *table, struct table *out);
void table_finish(struct table *table);

#endif
