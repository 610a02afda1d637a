/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Dense fields from OpenVDB trees. Only active values count: an inactive voxel or tile reads as 0
 * whatever is stored in it, as does everything outside the active bounding box. */
#include "io/vdb.h"

#include "base/field.h"
#include "io/vdb_file.h"

#include <openvdb/io/io.h>
#include <openvdb/tree/InternalNode.h>
#include <openvdb/tree/LeafNode.h>
#include <openvdb/tree/LeafNodeBool.h>
#include <openvdb/tree/LeafNodeMask.h>
#include <openvdb/tree/RootNode.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <istream>
#include <limits>
#include <memory>
#include <new>
#include <streambuf>
#include <unistd.h>

using namespace vdb;
using openvdb::Vec3d;

namespace {

/* Where array space begins, at the corner of its first voxel, in OpenVDB's index coordinates: those
 * stand for the centres of voxels, or to who asks for it for their corners. */
constexpr double CENTRES = -0.5, CORNERS = 0.0;

constexpr uint64_t DEFAULT_VOXELS = uint64_t{1} << 27;
/* Keeps every byte count below far from overflow; no machine holds so many. */
constexpr uint64_t MOST_VOXELS = uint64_t{1} << 44;

/* No exception leaves: whatever is thrown becomes a code and a sentence. */
template <class Body> brume_result guarded(const char *path, Body &&body)
{
    try {
        body();
        return BRUME_OK;
    } catch (const Failure &failure) {
        return failure.code;
    } catch (const std::bad_alloc &) {
        return fail(BRUME_E_MEMORY, "no memory to read '%s'", path);
    } catch (const std::length_error &) {
        return fail(BRUME_E_MEMORY, "no memory to read '%s'", path);
    } catch (const std::exception &exception) {
        return fail(BRUME_E_FILE_FORMAT, "'%s' is damaged: %s", path, exception.what());
    } catch (...) {
        return fail(BRUME_E_FILE_FORMAT, "'%s' is damaged", path);
    }
}

/* --- What the table and a grid's head tell ------------------------------------------------- */

/* As much of the name as fits, cut between characters of UTF-8. */
template <size_t N> void copy_name(char (&to)[N], const std::string &from)
{
    size_t length = std::min(from.size(), N - 1);
    while (length > 0 && length < from.size() &&
           (static_cast<unsigned char>(from[length]) & 0xC0) == 0x80)
        --length;
    std::memcpy(to, from.data(), length);
    std::memset(to + length, 0, N - length);
}

std::string type_name(const Entry &entry, const Head &head)
{
    const GridType &type = grid_type(entry.tree);
    std::string name;
    if (!type.tree)
        name = entry.tree;
    else
        name = entry.half && type.half_name ? type.half_name : type.name;
    return head.grid_class == "level set" ? "ls_" + name : name;
}

int medium_channels(const Entry &entry, const Head &head)
{
    return head.grid_class == "level set" ? 0 : grid_type(entry.tree).channels;
}

/* object_from_array of a field that begins `corner` beside voxel min and whose voxels are
 * `reduction` wide. False unless the matrix is linear, finite and invertible. */
bool place(const Head &head, const int64_t min[3], double corner, int64_t reduction,
           float out[16])
{
    double columns[4][3];
    for (int row = 0; row < 3; ++row) {
        columns[3][row] = head.matrix[3][row];
        for (int axis = 0; axis < 3; ++axis) {
            columns[axis][row] = head.matrix[axis][row] * static_cast<double>(reduction);
            columns[3][row] += (static_cast<double>(min[axis]) + corner) * head.matrix[axis][row];
        }
    }
    bool finite = true;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) {
            out[column * 4 + row] = static_cast<float>(columns[column][row]);
            finite = finite && std::isfinite(out[column * 4 + row]);
        }
        out[column * 4 + 3] = column == 3 ? 1.0f : 0.0f;
    }
    if (!head.linear || !finite)
        return false;

    /* What was rounded to floats counts: there 1e-200 is 0. */
    const Vec3d a(out[0], out[1], out[2]), b(out[4], out[5], out[6]), c(out[8], out[9], out[10]);
    const double determinant = a.dot(b.cross(c));
    const double lengths = a.length() * b.length() * c.length();
    /* Relative to the edges, so that small voxels are no singular ones; below this, floats cannot
     * invert it. */
    return lengths > 0.0 && std::abs(determinant) > 1e-6 * lengths;
}

/* The tree of one grid as bytes, and what the walk over it says. */
struct Section {
    std::vector<unsigned char> bytes;
    uint32_t compression;
    TreeFacts facts;
};

/* An instance shares the tree of the grid that it names. */
const Entry &owner_of_tree(const File &file, const Table &table, const Entry &entry)
{
    if (entry.parent.empty())
        return entry;
    for (const Entry &other : table.entries)
        if (other.unique_name == entry.parent && other.parent.empty() && other.tree == entry.tree &&
            other.half == entry.half)
            return other;
    throw Failure{fail(BRUME_E_FILE_FORMAT,
                       "'%s' is damaged: grid '%s' shares the tree of a grid that is not there",
                       file.path(), entry.name.c_str())};
}

Section read_section(File &file, const Table &table, const Entry &entry, const Head &own_head)
{
    const Entry &owner = owner_of_tree(file, table, entry);
    const Head head = &owner == &entry ? own_head : read_head(file, owner);
    if (head.tree == 0) /* the tree of a frustum, shared */
        throw Failure{fail(BRUME_E_UNSUPPORTED, "grid '%s' of '%s' shares the tree of a frustum",
                           entry.name.c_str(), file.path())};
    if (head.tree > owner.end)
        throw Failure{fail(BRUME_E_FILE_FORMAT, "'%s' is damaged: grid '%s' ends before its tree",
                           file.path(), entry.name.c_str())};

    Section section;
    file.seek(head.tree);
    const uint64_t size = owner.end - head.tree;
    const unsigned char *bytes = file.take(size);
    section.bytes.assign(bytes, bytes + size);
    section.compression = head.compression;
    Memory memory(file.path(), section.bytes.data(), size);
    section.facts = check_tree(memory, grid_type(owner.tree), owner.half, head.compression);
    return section;
}

brume_grid_info describe(const Entry &entry, const Head &head)
{
    brume_grid_info info = {};
    copy_name(info.name, entry.name);
    copy_name(info.type, type_name(entry, head));
    info.channels = medium_channels(entry, head);
    info.reduction = 1;
    return info;
}

/* --- The tree becomes a field --------------------------------------------------------------- */

/* Held voxels, and the sums of file voxels that fall into them. The work grows with active voxels,
 * tiles and held voxels, never with the box. */
struct Gatherer {
    int64_t min[3]; /* the file voxel where the field begins */
    int64_t reduction;
    int32_t dims[3];
    int channels;
    float *data;
    uint64_t bad_values = 0;

    double weight() const
    {
        return 1.0 / (double(reduction) * double(reduction) * double(reduction));
    }

    float *voxel(int64_t x, int64_t y, int64_t z)
    {
        return data + ((z * dims[1] + y) * dims[0] + x) * channels;
    }

    /* Adds to the sums; values that are not finite as floats are counted instead. */
    template <class T> void add(const T &value, double *sums)
    {
        if constexpr (openvdb::VecTraits<T>::IsVec) {
            for (int channel = 0; channel < 3; ++channel)
                add_scalar(value[channel], sums[channel]);
        } else {
            add_scalar(value, *sums);
        }
    }

    template <class T> void add_scalar(T value, double &sum)
    {
        const double wide = static_cast<double>(value);
        if (std::abs(wide) <= std::numeric_limits<float>::max())
            sum += wide;
        else
            ++bad_values;
    }

    /* Sums a leaf in double before it reaches the floats. */
    template <class Leaf> void leaf(const Leaf &leaf)
    {
        constexpr int SIDE = Leaf::DIM;
        if (leaf.isEmpty())
            return;
        int64_t first[3], cell[3][SIDE], count[3];
        for (int axis = 0; axis < 3; ++axis) {
            /* Parts of the leaf outside the box hold nothing active: any cell will do for them. */
            for (int i = 0; i < SIDE; ++i)
                cell[axis][i] = std::clamp<int64_t>(
                    (leaf.origin()[axis] + int64_t{i} - min[axis]) / reduction, 0, dims[axis] - 1);
            first[axis] = cell[axis][0];
            count[axis] = cell[axis][SIDE - 1] - first[axis] + 1;
        }
        double sums[SIDE * SIDE * SIDE * 3];
        std::fill_n(sums, count[0] * count[1] * count[2] * channels, 0.0);
        const auto sum = [&](int64_t x, int64_t y, int64_t z) {
            return sums + ((z * count[1] + y) * count[0] + x) * channels;
        };
        for (auto value = leaf.cbeginValueOn(); value; ++value) {
            const uint32_t at = value.pos(); /* z fastest */
            add(*value, sum(cell[0][at / (SIDE * SIDE)] - first[0],
                            cell[1][at / SIDE % SIDE] - first[1], cell[2][at % SIDE] - first[2]));
        }
        for (int64_t z = 0; z < count[2]; ++z)
            for (int64_t y = 0; y < count[1]; ++y)
                for (int64_t x = 0; x < count[0]; ++x)
                    for (int channel = 0; channel < channels; ++channel)
                        voxel(first[0] + x, first[1] + y, first[2] + z)[channel] +=
                            static_cast<float>(sum(x, y, z)[channel] * weight());
    }

    /* A cube of one value: each held voxel takes its share of the volume. */
    template <class T> void tile(const openvdb::Coord &origin, int64_t side, const T &value)
    {
        double values[3] = {0.0, 0.0, 0.0};
        add(value, values);
        int64_t first[3];
        std::vector<double> overlaps[3];
        for (int axis = 0; axis < 3; ++axis) {
            const int64_t begin = origin[axis] - min[axis], end = begin + side;
            first[axis] = begin / reduction;
            for (int64_t cell = first[axis]; cell * reduction < end; ++cell)
                overlaps[axis].push_back(static_cast<double>(std::min(end, (cell + 1) * reduction) -
                                                             std::max(begin, cell * reduction)));
        }
        for (size_t z = 0; z < overlaps[2].size(); ++z)
            for (size_t y = 0; y < overlaps[1].size(); ++y) {
                const double row = overlaps[2][z] * overlaps[1][y] * weight();
                float *to = voxel(first[0], first[1] + int64_t(y), first[2] + int64_t(z));
                for (const double overlap : overlaps[0])
                    for (int channel = 0; channel < channels; ++channel)
                        *to++ += static_cast<float>(values[channel] * overlap * row);
            }
    }

    template <class Node> void node(const Node &node)
    {
        using Child = typename Node::ChildNodeType;
        for (auto value = node.cbeginValueOn(); value; ++value)
            tile(value.getCoord(), Child::DIM, *value);
        for (auto child = node.cbeginChildOn(); child; ++child) {
            if constexpr (Node::LEVEL == 1)
                leaf(*child);
            else
                this->node(*child);
        }
    }
};

class MemoryStream final : public std::streambuf {
  public:
    explicit MemoryStream(std::vector<unsigned char> &bytes)
    {
        char *begin = reinterpret_cast<char *>(bytes.data());
        setg(begin, begin, begin + bytes.size());
    }
    uint64_t read() const { return static_cast<uint64_t>(gptr() - eback()); }
};

/* OpenVDB's standard tree: nodes of 4096, 128 and 8 voxels a side. */
template <class T>
using Root = openvdb::tree::RootNode<
    openvdb::tree::InternalNode<openvdb::tree::InternalNode<openvdb::tree::LeafNode<T, 3>, 4>, 5>>;

/* The checked bytes as OpenVDB's nodes. Not by way of io::File or a grid, which map the file into
 * memory, load later and read the metadata once more by other rules than the walk; nor of a Tree,
 * whose virtual functions take minutes to compile. */
template <class T>
std::unique_ptr<Root<T>> load_root(const Table &table, const Entry &entry, Section &section)
{
    MemoryStream buffer(section.bytes);
    std::istream stream(&buffer);
    stream.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
    auto metadata = std::make_shared<openvdb::io::StreamMetadata>();
    metadata->setFileVersion(table.version);
    metadata->setLibraryVersion({table.library_major, table.library_minor});
    metadata->setCompression(section.compression);
    metadata->setHalfFloat(entry.half);
    openvdb::io::setStreamMetadataPtr(stream, metadata, /*transfer=*/true);

    auto root = std::make_unique<Root<T>>();
    stream.ignore(sizeof(int32_t)); /* the number of buffers */
    root->readTopology(stream, entry.half);
    root->readBuffers(stream, entry.half);
    if (buffer.read() != section.facts.end)
        throw std::runtime_error("OpenVDB reads another length than the grid has");
    return root;
}

template <class T>
void gather(const Table &table, const Entry &entry, Section &section, Gatherer &gatherer)
{
    const auto root = load_root<T>(table, entry, section);
    section.bytes = {};
    gatherer.node(*root);
}

void gather_any(const Table &table, const Entry &entry, Section &section, Gatherer &gatherer)
{
    const std::string name = grid_type(entry.tree).name;
    const auto function = name == "float"    ? gather<float>
                          : name == "double" ? gather<double>
                          : name == "int32"  ? gather<int32_t>
                          : name == "int64"  ? gather<int64_t>
                          : name == "bool"   ? gather<bool>
                          : name == "mask"   ? gather<openvdb::ValueMask>
                          : name == "vec3s"  ? gather<openvdb::Vec3s>
                          : name == "vec3d"  ? gather<openvdb::Vec3d>
                                             : gather<openvdb::Vec3i>;
    function(table, entry, section, gatherer);
}

/* The smallest whole number that brings the box below the limit; 0 if there is none. */
int64_t choose_reduction(const int64_t file_dims[3], uint64_t max_voxels)
{
    constexpr int64_t MOST = std::numeric_limits<int32_t>::max();
    const auto fits = [&](int64_t reduction) {
        unsigned __int128 voxels = 1;
        for (int axis = 0; axis < 3; ++axis) {
            const int64_t held = (file_dims[axis] + reduction - 1) / reduction;
            if (held > MOST)
                return false;
            voxels *= static_cast<uint64_t>(held);
        }
        return voxels <= max_voxels;
    };
    if (!fits(MOST))
        return 0;
    int64_t low = 1, high = MOST;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (fits(middle))
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

const Entry &find_grid(const File &file, const Table &table, const char *name)
{
    const auto shown = [&](const Entry &entry) { return describe(entry, Head{}); };
    for (const Entry &entry : table.entries)
        if (entry.name == name || std::strcmp(shown(entry).name, name) == 0)
            return entry;
    /* "density" alone also finds the first of several that the file numbers. */
    for (const Entry &entry : table.entries)
        if (entry.unique_name.substr(0, entry.unique_name.find('\x1e')) == name)
            return entry;

    constexpr size_t LONGEST_LIST = 600;
    std::string names;
    for (const Entry &entry : table.entries) {
        if (names.size() > LONGEST_LIST) {
            names += ", ...";
            break;
        }
        names += (names.empty() ? "'" : ", '") + std::string(shown(entry).name) + "'";
    }
    throw Failure{fail(BRUME_E_GRID_UNKNOWN, "'%s' has no grid '%s'; it has %s", file.path(), name,
                       names.empty() ? "none" : names.c_str())};
}

void require_memory(const char *path, const char *name, uint64_t bytes)
{
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    if (pages > 0 && page > 0 && bytes / static_cast<uint64_t>(page) > static_cast<uint64_t>(pages))
        throw Failure{fail(BRUME_E_MEMORY,
                           "grid '%s' of '%s' takes %llu MiB, more than this machine has", name,
                           path, static_cast<unsigned long long>(bytes >> 20))};
}

brume_grid *load(const char *path, const char *name, uint64_t max_voxels, double corner)
{
    File file(path);
    const Table table = read_table(file);
    const Entry &entry = find_grid(file, table, name);
    const Head head = read_head(file, entry);
    brume_grid_info info = describe(entry, head);
    if (info.channels == 0)
        throw Failure{fail(BRUME_E_GRID_TYPE, "grid '%s' of '%s' has the type %s, no medium",
                           info.name, path, info.type)};

    int64_t min[3] = {0, 0, 0};
    const auto require_place = [&](int64_t reduction) {
        if (!place(head, min, corner, reduction, info.object_from_array))
            throw Failure{fail(BRUME_E_TRANSFORM, "the transform of grid '%s' of '%s' is %s",
                               info.name, path,
                               head.linear ? "singular or not finite" : "not linear")};
    };
    require_place(1);

    Section section = read_section(file, table, entry, head);
    const TreeFacts &facts = section.facts;
    if (facts.empty)
        throw Failure{
            fail(BRUME_E_GRID_EMPTY, "grid '%s' of '%s' has no active voxel", info.name, path)};
    for (int axis = 0; axis < 3; ++axis) {
        min[axis] = facts.min[axis];
        info.file_dims[axis] = facts.max[axis] - facts.min[axis] + 1;
    }
    max_voxels = std::min(max_voxels ? max_voxels : DEFAULT_VOXELS, MOST_VOXELS);
    const int64_t reduction = choose_reduction(info.file_dims, max_voxels);
    if (reduction == 0)
        throw Failure{fail(BRUME_E_MEMORY, "grid '%s' of '%s' does not fit into %llu voxels",
                           info.name, path, static_cast<unsigned long long>(max_voxels))};
    info.reduction = static_cast<int32_t>(reduction);
    uint64_t held = 1;
    for (int axis = 0; axis < 3; ++axis) {
        info.dims[axis] = static_cast<int32_t>((info.file_dims[axis] + reduction - 1) / reduction);
        held *= static_cast<uint64_t>(info.dims[axis]);
    }
    require_place(reduction);
    require_memory(path, info.name,
                   facts.memory + held * static_cast<uint64_t>(info.channels) * sizeof(float));

    brume_grid *made = nullptr;
    const brume_result created = field_create(&info, &made);
    if (created != BRUME_OK)
        throw Failure{created};
    std::unique_ptr<brume_grid, void (*)(brume_grid *)> field(made, field_release);

    Gatherer gatherer = {{min[0], min[1], min[2]},
                         reduction,
                         {info.dims[0], info.dims[1], info.dims[2]},
                         info.channels,
                         made->data};
    gather_any(table, entry, section, gatherer);
    if (gatherer.bad_values)
        throw Failure{fail(BRUME_E_GRID_VALUES, "grid '%s' of '%s' has %llu NaN or infinite values",
                           info.name, path, static_cast<unsigned long long>(gatherer.bad_values))};
    const brume_result finished = field_finish(made);
    if (finished != BRUME_OK)
        throw Failure{finished};
    return field.release();
}

brume_grid_info list_one(File &file, const Table &table, const Entry &entry)
{
    const Head head = read_head(file, entry);
    brume_grid_info info = describe(entry, head);
    int64_t min[3] = {0, 0, 0};
    if (head.has_box) {
        for (int axis = 0; axis < 3; ++axis) {
            const int64_t dim = int64_t{head.box_max[axis]} - head.box_min[axis] + 1;
            min[axis] = head.box_min[axis];
            info.file_dims[axis] = dim > 0 ? dim : 0;
        }
    } else if (info.channels > 0 && head.linear) {
        const TreeFacts facts = read_section(file, table, entry, head).facts;
        for (int axis = 0; axis < 3 && !facts.empty; ++axis) {
            min[axis] = facts.min[axis];
            info.file_dims[axis] = facts.max[axis] - facts.min[axis] + 1;
        }
    }
    info.supported = place(head, min, CENTRES, 1, info.object_from_array) && info.channels > 0;
    return info;
}

} // namespace

brume_result vdb_list(const char *path, brume_grid_info *infos, uint32_t capacity, uint32_t *count)
{
    REQUIRE(path && count);
    REQUIRE(infos || capacity == 0);
    return guarded(path, [&] {
        File file(path);
        const Table table = read_table(file);
        const uint32_t total = static_cast<uint32_t>(table.entries.size());
        for (uint32_t i = 0; i < std::min(total, capacity); ++i)
            infos[i] = list_one(file, table, table.entries[i]);
        *count = total;
    });
}

brume_result vdb_load(const char *path, const char *name, uint64_t max_voxels, bool at_corner,
                      brume_grid **out)
{
    REQUIRE(path && name && out);
    const double corner = at_corner ? CORNERS : CENTRES;
    return guarded(path, [&] { *out = load(path, name, max_voxels, corner); });
}
