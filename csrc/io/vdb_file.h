/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The bytes of a .vdb file: its table of grids, and the check that one grid's tree is whole. Any
 * thread.
 *
 * OpenVDB trusts its input: in 10.0 a damaged block length makes it write past a buffer and crash,
 * Blosc is not told how many bytes a block has, and a damaged string length allocates 4 GiB.
 * Nothing of a file reaches OpenVDB before the walk below, which follows the layout of versions
 * 222 (2013) and later, has found every length, mask and position in order. The walk reads from
 * memory that is then handed to OpenVDB, so a file rewritten meanwhile cannot differ from what was
 * checked.
 */
#ifndef BRUME_IO_VDB_FILE_H
#define BRUME_IO_VDB_FILE_H

#include "base/result.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vdb {

/* Thrown after fail() has stored the sentence; vdb.cpp turns it back into its code. */
struct Failure {
    brume_result code;
};

/* How a kind of tree lies in the file. */
struct GridType {
    const char *tree;      /* the file's name of it */
    const char *name;      /* ours, and that of its variant saved as half floats */
    const char *half_name; /* NULL: is never stored as half */
    int channels;          /* 1 or 3; 0 where it is no medium */
    uint32_t value_bytes;
    enum Leaf { VALUES, BOOL, MASK } leaf;
};

/* Never NULL: an unknown kind gives the entry whose tree is NULL. */
const GridType &grid_type(const std::string &tree);

/* Bytes taken one after the other, never beyond the end. */
class Input {
  public:
    virtual ~Input() = default;
    /* The next count bytes, valid until the next take; fails where the file ends before. */
    virtual const unsigned char *take(uint64_t count) = 0;
    virtual void skip(uint64_t count) = 0;
    template <class T> T value();
    std::string string();
};

class File final : public Input {
  public:
    explicit File(const char *path);
    ~File() override;
    File(const File &) = delete;
    File &operator=(const File &) = delete;

    const unsigned char *take(uint64_t count) override;
    void skip(uint64_t count) override;
    void seek(uint64_t to);
    uint64_t tell() const { return position_; }
    const char *path() const { return path_; }

  private:
    const char *path_;
    int descriptor_;
    uint64_t size_ = 0, position_ = 0;
    std::vector<unsigned char> scratch_;
};

class Memory final : public Input {
  public:
    Memory(const char *path, const unsigned char *data, uint64_t size)
        : path_(path), data_(data), size_(size)
    {
    }
    const unsigned char *take(uint64_t count) override;
    void skip(uint64_t count) override { take(count); }
    uint64_t tell() const { return position_; }
    const char *path() const { return path_; }

  private:
    const char *path_;
    const unsigned char *data_;
    uint64_t size_, position_ = 0;
};

/* One line of the file's table of grids. */
struct Entry {
    std::string unique_name; /* as other entries refer to it */
    std::string name;        /* as people see it: "density", "density[1]" */
    std::string tree;
    std::string parent; /* unique name of the grid whose tree it shares, or empty */
    bool half;
    uint64_t begin, end; /* bytes of the grid in the file */
};

struct Table {
    uint32_t version, library_major, library_minor;
    std::vector<Entry> entries;
};

Table read_table(File &file);

/* What stands before a grid's tree. */
struct Head {
    uint32_t compression;
    uint64_t tree;          /* where the tree begins; 0 unless linear */
    bool linear;            /* index space maps to the object's by the matrix */
    double matrix[4][3];    /* images of the three axes, then of the origin */
    std::string grid_class; /* "fog volume", "level set" … */
    bool has_box;           /* the file claims an active bounding box */
    int32_t box_min[3], box_max[3];
};

Head read_head(File &file, const Entry &entry);

/* What the walk found. Coordinates of voxels, both ends inclusive. */
struct TreeFacts {
    bool empty = true; /* no active voxel or tile */
    int64_t min[3], max[3];
    uint64_t memory = 0; /* bytes the tree takes once loaded, about */
    uint64_t end = 0;    /* where the walk stopped */
};

/* Walks topology and buffers; fails with BRUME_E_FILE_FORMAT at the first thing out of order. */
TreeFacts check_tree(Memory &memory, const GridType &type, bool half, uint32_t compression);

} // namespace vdb

#endif
