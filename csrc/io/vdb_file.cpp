/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Walks the bytes of a .vdb file, believing nothing. */
#include "io/vdb_file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <set>
#include <sys/stat.h>
#include <tuple>
#include <unistd.h>

namespace vdb {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "OpenVDB files are little-endian");

namespace {

[[noreturn]] void damaged(const char *path, const char *what)
{
    throw Failure{fail(BRUME_E_FILE_FORMAT, "'%s' is damaged: %s", path, what)};
}

[[noreturn]] void truncated(const char *path, uint64_t at)
{
    throw Failure{fail(BRUME_E_FILE_FORMAT, "'%s' is truncated or damaged at byte %llu", path,
                       static_cast<unsigned long long>(at))};
}

constexpr GridType TYPES[] = {
    {"Tree_float_5_4_3", "float", "half", 1, 4, GridType::VALUES},
    {"Tree_double_5_4_3", "double", "half", 1, 8, GridType::VALUES},
    {"Tree_int32_5_4_3", "int32", nullptr, 1, 4, GridType::VALUES},
    {"Tree_int64_5_4_3", "int64", nullptr, 1, 8, GridType::VALUES},
    {"Tree_bool_5_4_3", "bool", nullptr, 1, 1, GridType::BOOL},
    {"Tree_mask_5_4_3", "mask", nullptr, 1, 1, GridType::MASK},
    {"Tree_vec3s_5_4_3", "vec3s", "vec3h", 3, 12, GridType::VALUES},
    {"Tree_vec3d_5_4_3", "vec3d", "vec3h", 3, 24, GridType::VALUES},
    {"Tree_vec3i_5_4_3", "vec3i", nullptr, 3, 12, GridType::VALUES},
    {"Tree_ptdataidx32_5_4_3", "points", nullptr, 0, 0, GridType::VALUES},
    {"Tree_ptidx32_5_4_3", "point_index", nullptr, 0, 0, GridType::VALUES},
    {nullptr, nullptr, nullptr, 0, 0, GridType::VALUES},
};

} // namespace

const GridType &grid_type(const std::string &tree)
{
    const GridType *type = TYPES;
    while (type->tree && tree != type->tree)
        ++type;
    return *type;
}

/* --- Bytes ------------------------------------------------------------------------------- */

template <class T> T Input::value()
{
    T result;
    std::memcpy(&result, take(sizeof result), sizeof result);
    return result;
}

std::string Input::string()
{
    const uint32_t length = value<uint32_t>();
    return std::string(reinterpret_cast<const char *>(take(length)), length);
}

File::File(const char *path) : path_(path)
{
    /* Not to hang on a pipe of that name. */
    descriptor_ = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor_ < 0)
        throw Failure{fail(BRUME_E_FILE_MISSING, "cannot open '%s': %s", path, strerror(errno))};
    struct stat status;
    if (fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
        close(descriptor_);
        throw Failure{fail(BRUME_E_FILE_MISSING, "'%s' is not a file", path)};
    }
    size_ = static_cast<uint64_t>(status.st_size);
}

File::~File()
{
    close(descriptor_);
}

const unsigned char *File::take(uint64_t count)
{
    if (count > size_ - position_)
        truncated(path_, position_);
    scratch_.resize(count ? count : 1);
    for (uint64_t done = 0; done < count;) {
        const ssize_t got = pread(descriptor_, scratch_.data() + done, count - done,
                                  static_cast<off_t>(position_ + done));
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            throw Failure{
                fail(BRUME_E_FILE_FORMAT, "cannot read '%s': %s", path_, strerror(errno))};
        if (got == 0) /* somebody cut the file meanwhile */
            truncated(path_, position_ + done);
        done += static_cast<uint64_t>(got);
    }
    position_ += count;
    return scratch_.data();
}

void File::skip(uint64_t count)
{
    if (count > size_ - position_)
        truncated(path_, position_);
    position_ += count;
}

void File::seek(uint64_t to)
{
    if (to > size_)
        truncated(path_, size_);
    position_ = to;
}

const unsigned char *Memory::take(uint64_t count)
{
    if (count > size_ - position_)
        damaged(path_, "a grid's tree runs beyond the grid's end");
    const unsigned char *bytes = data_ + position_;
    position_ += count;
    return bytes;
}

/* --- The table of grids ------------------------------------------------------------------ */

namespace {

/* Calls visit(name, type, size) with the input at each value, then goes to the next one. */
template <class Visit> void each_metadatum(File &file, Visit &&visit)
{
    const uint32_t count = file.value<uint32_t>();
    for (uint32_t i = 0; i < count; ++i) {
        const std::string name = file.string(), type = file.string();
        const uint32_t size = file.value<uint32_t>();
        const uint64_t begin = file.tell();
        visit(name, type, size);
        file.seek(begin);
        file.skip(size);
    }
}

/* Every linear map is a few doubles. Read here, since OpenVDB throws for damaged ones and small
 * voxels (1e-5) alike. */
void read_transform(File &file, Head &head)
{
    const std::string map = file.string();
    const bool scale = map == "ScaleMap" || map == "UniformScaleMap";
    const bool scale_translate = map == "ScaleTranslateMap" || map == "UniformScaleTranslateMap";
    const bool affine = map == "AffineMap" || map == "UnitaryMap";
    if (!scale && !scale_translate && !affine && map != "TranslationMap")
        return;

    /* After the scale come its inverse and other products of it, four triples. */
    const int count = affine ? 16 : scale ? 15 : scale_translate ? 18 : 3;
    double values[18];
    std::memcpy(values, file.take(count * sizeof *values), count * sizeof *values);
    head.linear = true;
    head.tree = file.tell();
    if (affine) {
        /* A matrix for row vectors, row by row. */
        for (int row = 0; row < 4; ++row) {
            std::memcpy(head.matrix[row], values + 4 * row, sizeof head.matrix[row]);
            head.linear = head.linear && values[4 * row + 3] == (row == 3 ? 1.0 : 0.0);
        }
        return;
    }
    for (int axis = 0; axis < 3; ++axis) {
        head.matrix[axis][axis] = scale ? values[axis] : scale_translate ? values[3 + axis] : 1.0;
        head.matrix[3][axis] = scale ? 0.0 : values[axis];
    }
}

} // namespace

Table read_table(File &file)
{
    constexpr int64_t MAGIC = 0x56444220;
    constexpr uint32_t NODE_MASK_COMPRESSION = 222;

    unsigned char start[8] = {0};
    try {
        std::memcpy(start, file.take(sizeof start), sizeof start);
    } catch (const Failure &) {
        throw Failure{
            fail(BRUME_E_FILE_FORMAT, "'%s' is no OpenVDB file: it is too short", file.path())};
    }
    int64_t magic;
    std::memcpy(&magic, start, sizeof magic);
    if (magic != MAGIC)
        throw Failure{fail(BRUME_E_FILE_FORMAT, "'%s' is no OpenVDB file", file.path())};

    Table table;
    table.version = file.value<uint32_t>();
    if (table.version < NODE_MASK_COMPRESSION)
        throw Failure{fail(BRUME_E_FILE_FORMAT,
                           "'%s' has the OpenVDB file version %u; those before %u are not read",
                           file.path(), table.version, NODE_MASK_COMPRESSION)};
    table.library_major = file.value<uint32_t>();
    table.library_minor = file.value<uint32_t>();
    if (file.value<uint8_t>() == 0)
        throw Failure{fail(BRUME_E_UNSUPPORTED,
                           "'%s' was written as a stream, without the positions of its grids",
                           file.path())};
    file.skip(36); /* uuid */
    each_metadatum(file, [](const std::string &, const std::string &, uint32_t) {});

    const int32_t count = file.value<int32_t>();
    if (count < 0)
        damaged(file.path(), "it has a negative number of grids");
    static const std::string HALF = "_HalfFloat";
    for (int32_t i = 0; i < count; ++i) {
        Entry entry;
        entry.unique_name = file.string();
        entry.tree = file.string();
        entry.parent = file.string();
        entry.begin = file.value<uint64_t>();
        file.skip(8); /* where the buffers begin */
        entry.end = file.value<uint64_t>();
        /* Ends that only grow also end this loop, whatever the count. */
        if (entry.begin < file.tell() || entry.end < entry.begin)
            damaged(file.path(), "the positions of its grids are out of order");

        const size_t separator = entry.unique_name.find('\x1e');
        entry.name = entry.unique_name.substr(0, separator);
        if (separator != std::string::npos)
            entry.name += "[" + entry.unique_name.substr(separator + 1) + "]";
        entry.half = entry.tree.size() > HALF.size() &&
                     entry.tree.compare(entry.tree.size() - HALF.size(), HALF.size(), HALF) == 0;
        if (entry.half)
            entry.tree.resize(entry.tree.size() - HALF.size());
        file.seek(entry.end);
        table.entries.push_back(entry);
    }
    return table;
}

Head read_head(File &file, const Entry &entry)
{
    Head head = {};
    bool has_min = false, has_max = false;
    file.seek(entry.begin);
    head.compression = file.value<uint32_t>();
    each_metadatum(file, [&](const std::string &name, const std::string &type, uint32_t size) {
        const bool box = type == "vec3i" && size == sizeof head.box_min;
        if (name == "class" && type == "string") {
            head.grid_class.assign(reinterpret_cast<const char *>(file.take(size)), size);
        } else if (name == "file_bbox_min" && box) {
            std::memcpy(head.box_min, file.take(size), size);
            has_min = true;
        } else if (name == "file_bbox_max" && box) {
            std::memcpy(head.box_max, file.take(size), size);
            has_max = true;
        }
    });
    head.has_box = has_min && has_max;
    read_transform(file, head);
    return head;
}

/* --- The tree ---------------------------------------------------------------------------- */

namespace {

enum Compression : uint32_t { ZIP = 1, ACTIVE_MASK = 2, BLOSC = 4 };

bool bit(const unsigned char *mask, uint32_t index)
{
    return mask[index >> 3] >> (index & 7) & 1;
}

uint32_t count_bits(const unsigned char *mask, uint32_t size)
{
    uint32_t count = 0;
    for (uint32_t byte = 0; byte < size / 8; ++byte)
        count += static_cast<uint32_t>(__builtin_popcount(mask[byte]));
    return count;
}

class Walk {
  public:
    Walk(Memory &memory, const GridType &type, bool half, uint32_t compression)
        : in_(memory), type_(type), compression_(compression),
          stored_bytes_(half && type.half_name ? (type.channels == 3 ? 6u : 2u) : type.value_bytes),
          half_(half && type.half_name)
    {
    }

    TreeFacts run()
    {
        if (compression_ > (ZIP | ACTIVE_MASK | BLOSC))
            bad("an unknown compression");
        root();
        for (const Leaf &leaf : leaves_)
            buffer(leaf);
        facts_.end = in_.tell();
        return facts_;
    }

  private:
    static constexpr uint32_t LEAF_LOG2 = 3, LEAF_VALUES = 512, MASK_BYTES = 64;

    struct Leaf {
        int32_t origin[3];
        const unsigned char *mask;
    };

    [[noreturn]] void bad(const char *what) const { damaged(in_.path(), what); }

    void include(const int32_t origin[3], const uint32_t low[3], const uint32_t high[3])
    {
        for (int axis = 0; axis < 3; ++axis) {
            const int64_t first = int64_t{origin[axis]} + low[axis];
            const int64_t last = int64_t{origin[axis]} + high[axis];
            facts_.min[axis] = facts_.empty || first < facts_.min[axis] ? first : facts_.min[axis];
            facts_.max[axis] = facts_.empty || last > facts_.max[axis] ? last : facts_.max[axis];
        }
        facts_.empty = false;
    }

    void include_tile(const int32_t origin[3], uint32_t size)
    {
        const uint32_t low[3] = {0, 0, 0}, high[3] = {size - 1, size - 1, size - 1};
        include(origin, low, high);
    }

    /* Values of one node: a byte that says how inactive ones are stored, those, then the block. */
    void values(uint32_t count, const unsigned char *mask)
    {
        const uint8_t scheme = *in_.take(1);
        if (scheme > 6)
            bad("an unknown scheme of inactive values");
        if (scheme == 2 || scheme == 4 || scheme == 5)
            in_.skip(type_.value_bytes);
        if (scheme == 5)
            in_.skip(type_.value_bytes);
        if (scheme == 3 || scheme == 4 || scheme == 5)
            in_.skip(count / 8);
        if ((compression_ & ACTIVE_MASK) && scheme != 6)
            count = count_bits(mask, count);
        if (half_ && count == 0)
            return;
        block(uint64_t{count} * stored_bytes_);
    }

    void block(uint64_t bytes)
    {
        if (!(compression_ & (ZIP | BLOSC))) {
            in_.skip(bytes);
            return;
        }
        const int64_t size = in_.value<int64_t>();
        if (size <= 0) { /* stored as it is */
            if (uint64_t{0} - static_cast<uint64_t>(size) != bytes)
                bad("a block of another length than its node has");
            in_.skip(bytes);
            return;
        }
        const unsigned char *packed = in_.take(static_cast<uint64_t>(size));
        if (compression_ & BLOSC) {
            constexpr int64_t BLOSC_HEADER = 16;
            uint32_t unpacked_size = 0, packed_size = 0;
            if (size >= BLOSC_HEADER) {
                std::memcpy(&unpacked_size, packed + 4, 4);
                std::memcpy(&packed_size, packed + 12, 4);
            }
            if (size < BLOSC_HEADER || packed_size != size || unpacked_size != bytes)
                bad("a Blosc block of another length than its node has");
        }
    }

    void root()
    {
        constexpr uint32_t LOG2 = 12; /* of the voxels that a child of the root spans */
        if (in_.value<int32_t>() != 1)
            bad("a tree with several buffers");
        in_.skip(type_.value_bytes); /* background */
        const uint32_t tiles = in_.value<uint32_t>(), children = in_.value<uint32_t>();

        std::set<std::tuple<int32_t, int32_t, int32_t>> seen;
        const auto origin = [&](int32_t out[3]) {
            std::memcpy(out, in_.take(3 * sizeof *out), 3 * sizeof *out);
            for (int axis = 0; axis < 3; ++axis)
                if (out[axis] & ((1 << LOG2) - 1))
                    bad("a root node's child off its lattice");
            if (!seen.emplace(out[0], out[1], out[2]).second)
                bad("a root node with two children in one place");
        };
        int32_t at[3];
        for (uint32_t i = 0; i < tiles; ++i) {
            origin(at);
            in_.skip(type_.value_bytes);
            const uint8_t active = *in_.take(1);
            if (active > 1)
                bad("a tile neither active nor inactive");
            if (active)
                include_tile(at, 1u << LOG2);
        }
        for (uint32_t i = 0; i < children; ++i) {
            origin(at);
            internal(at, 5, 7);
        }
    }

    /* A node of (2^log2)^3 entries, each of which spans 2^span voxels a side. */
    void internal(const int32_t origin[3], uint32_t log2, uint32_t span)
    {
        const uint32_t count = 1u << (3 * log2), side = (1u << log2) - 1;
        const unsigned char *child_mask = in_.take(count / 8), *value_mask = in_.take(count / 8);
        values(count, value_mask);
        facts_.memory += uint64_t{count} * (type_.value_bytes > 8 ? 8 + type_.value_bytes : 8);

        for (uint32_t i = 0; i < count; ++i) {
            const bool child = bit(child_mask, i), active = bit(value_mask, i);
            if (!child && !active)
                continue;
            if (child && active)
                bad("a node with both a child and a tile in one place");
            const uint32_t offset[3] = {i >> (2 * log2), i >> log2 & side, i & side};
            int32_t at[3];
            for (int axis = 0; axis < 3; ++axis) /* inside the root's child: cannot overflow */
                at[axis] = origin[axis] + static_cast<int32_t>(offset[axis] << span);
            if (active)
                include_tile(at, 1u << span);
            else if (span == LEAF_LOG2)
                leaf(at);
            else
                internal(at, 4, LEAF_LOG2);
        }
    }

    void leaf(const int32_t origin[3])
    {
        const unsigned char *mask = in_.take(MASK_BYTES);
        leaves_.push_back({{origin[0], origin[1], origin[2]}, mask});
        facts_.memory +=
            128 + (type_.leaf == GridType::VALUES ? uint64_t{LEAF_VALUES} * type_.value_bytes
                                                  : MASK_BYTES);

        /* Byte 8 x + y of the mask holds the row of that x and y, bit z. */
        uint32_t low[3] = {8, 8, 8}, high[3] = {0, 0, 0};
        for (uint32_t byte = 0; byte < MASK_BYTES; ++byte) {
            if (!mask[byte])
                continue;
            const uint32_t bits = mask[byte];
            const uint32_t first[3] = {byte >> 3, byte & 7,
                                       static_cast<uint32_t>(__builtin_ctz(bits))};
            const uint32_t last[3] = {byte >> 3, byte & 7,
                                      31u - static_cast<uint32_t>(__builtin_clz(bits))};
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = first[axis] < low[axis] ? first[axis] : low[axis];
                high[axis] = last[axis] > high[axis] ? last[axis] : high[axis];
            }
        }
        if (low[0] < 8)
            include(origin, low, high);
    }

    /* The second half of the file repeats each leaf's mask before its values. */
    void buffer(const Leaf &leaf)
    {
        if (std::memcmp(in_.take(MASK_BYTES), leaf.mask, MASK_BYTES) != 0)
            bad("a leaf whose two masks differ");
        if (type_.leaf == GridType::VALUES) {
            values(LEAF_VALUES, leaf.mask);
            return;
        }
        if (std::memcmp(in_.take(sizeof leaf.origin), leaf.origin, sizeof leaf.origin) != 0)
            bad("a leaf out of its place");
        if (type_.leaf == GridType::BOOL)
            in_.skip(MASK_BYTES);
    }

    Memory &in_;
    const GridType &type_;
    const uint32_t compression_, stored_bytes_;
    const bool half_;
    TreeFacts facts_;
    std::vector<Leaf> leaves_;
};

} // namespace

TreeFacts check_tree(Memory &memory, const GridType &type, bool half, uint32_t compression)
{
    return Walk(memory, type, half, compression).run();
}

} // namespace vdb
