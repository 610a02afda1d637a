/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sorted tables of datablocks. */
#include "scene/table.h"
#include "base/result.h"

#include <stdlib.h>
#include <string.h>

void block_init(struct block *block, void (*destroy)(struct block *))
{
    block->references = 1;
    block->destroy = destroy;
}

struct block *block_retain(struct block *block)
{
    __atomic_add_fetch(&block->references, 1, __ATOMIC_RELAXED);
    return block;
}

void block_release(struct block *block)
{
    if (block && __atomic_sub_fetch(&block->references, 1, __ATOMIC_ACQ_REL) == 0)
        block->destroy(block);
}

/* The place of the key, or where it would go. */
static uint32_t lower_bound(const struct table *table, uint64_t key)
{
    uint32_t low = 0, high = table->count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (table->entries[middle].key < key)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

brume_result table_set(struct table *table, uint64_t key, uint64_t revision, struct block *block)
{
    const uint32_t place = lower_bound(table, key);
    if (place < table->count && table->entries[place].key == key) {
        block_release(table->entries[place].block);
    } else {
        if (table->count == table->capacity) {
            const uint32_t capacity = table->capacity ? table->capacity * 2 : 16;
            struct entry *grown = realloc(table->entries, capacity * sizeof *grown);
            if (!grown) {
                block_release(block);
                return fail(BRUME_E_MEMORY, "no memory for %u datablocks", capacity);
            }
            table->entries = grown;
            table->capacity = capacity;
        }
        memmove(table->entries + place + 1, table->entries + place,
                (table->count - place) * sizeof *table->entries);
        ++table->count;
    }
    table->entries[place] = (struct entry){.key = key, .revision = revision, .block = block};
    table->revision = revision;
    return BRUME_OK;
}

void table_remove(struct table *table, uint64_t key, uint64_t revision)
{
    const uint32_t place = lower_bound(table, key);
    if (place == table->count || table->entries[place].key != key)
        return;
    block_release(table->entries[place].block);
    --table->count;
    memmove(table->entries + place, table->entries + place + 1,
            (table->count - place) * sizeof *table->entries);
    table->revision = revision;
}

static int compare_keys(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

brume_result table_keep(struct table *table, const uint64_t *keys, uint64_t count,
                        uint64_t revision)
{
    uint64_t *sorted = malloc((count ? count : 1) * sizeof *sorted);
    if (!sorted)
        return fail(BRUME_E_MEMORY, "no memory for %llu keys", (unsigned long long)count);
    if (count)
        memcpy(sorted, keys, count * sizeof *sorted);
    qsort(sorted, count, sizeof *sorted, compare_keys);
    uint32_t kept = 0;
    uint64_t next = 0;
    for (uint32_t i = 0; i < table->count; ++i) {
        const struct entry entry = table->entries[i];
        while (next < count && sorted[next] < entry.key)
            ++next;
        if (next < count && sorted[next] == entry.key)
            table->entries[kept++] = entry;
        else
            block_release(entry.block);
    }
    free(sorted);
    if (kept != table->count)
        table->revision = revision;
    table->count = kept;
    return BRUME_OK;
}

const struct entry *table_find(const struct table *table, uint64_t key)
{
    const uint32_t place = lower_bound(table, key);
    if (place < table->count && table->entries[place].key == key)
        return &table->entries[place];
    return NULL;
}

brume_result table_snapshot(const struct table *table, struct table *out)
{
    *out = (struct table){.revision = table->revision};
    if (table->count == 0)
        return BRUME_OK;
    out->entries = malloc(table->count * sizeof *out->entries);
    if (!out->entries)
        return fail(BRUME_E_MEMORY, "no memory for %u datablocks", table->count);
    out->count = out->capacity = table->count;
    memcpy(out->entries, table->entries, table->count * sizeof *out->entries);
    for (uint32_t i = 0; i < out->count; ++i)
        block_retain(out->entries[i].block);
    return BRUME_OK;
}

void table_finish(struct table *table)
{
    for (uint32_t i = 0; i < table->count; ++i)
        block_release(table->entries[i].block);
    free(table->entries);
    memset(table, 0, sizeof *table);
}
