/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OpenVDB files: types, tiles, transforms, coarser fields, refusals, damage. */
#include "base/field.h"
#include "base/result.h"
#include "io/vdb.h"

/* The project hides its symbols. OpenVDB's templates here must be one with those in its library:
 * of Tree::treeType, one half hidden and one not crashes openvdb::initialize. */
#pragma GCC visibility push(default)
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>
#pragma GCC visibility pop

#include <chrono>
#include <climits>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include <csetjmp>
#include <cstdarg>
extern "C" {
#include <cmocka.h>
}
#undef skip /* a macro of cmocka, a name in the headers above */

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::Vec3d;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool SANITIZED = true; /* whose shadow needs terabytes of address space */
#else
constexpr bool SANITIZED = false;
#endif

static std::string folder;

static std::string in_folder(const char *name)
{
    return folder + "/" + name;
}

static int make_folder(void **)
{
    openvdb::initialize();
    char path[] = "/tmp/brume-vdb-XXXXXX";
    if (!mkdtemp(path))
        return -1;
    folder = path;
    return 0;
}

static int remove_folder(void **)
{
    for (const char *name : {"a.vdb", "bad.vdb", "pipe.vdb", "text.vdb", "empty.vdb"})
        unlink(in_folder(name).c_str());
    return rmdir(folder.c_str());
}

/* By OpenVDB's registry: to construct a grid here would compile the whole of its class. */
template <class Grid> static typename Grid::Ptr make(const char *name)
{
    const auto grid = openvdb::gridPtrCast<Grid>(openvdb::GridBase::createGrid(Grid::gridType()));
    grid->setName(name);
    return grid;
}

static void write(const openvdb::GridPtrVec &grids, uint32_t compression, bool statistics = true)
{
    openvdb::io::File file(in_folder("a.vdb"));
    file.setCompression(compression);
    file.setGridStatsMetadataEnabled(statistics);
    file.write(grids);
    file.close();
}

static void write(const openvdb::GridBase::Ptr &grid)
{
    write({grid}, openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
}

struct Field {
    brume_grid *grid;
    explicit Field(const char *name, uint64_t max_voxels = 0, const char *file = "a.vdb",
                   bool at_corner = false)
        : grid(nullptr)
    {
        if (vdb_load(in_folder(file).c_str(), name, max_voxels, at_corner, &grid) != BRUME_OK)
            fail_msg("%s", last_error());
    }
    ~Field() { field_release(grid); }
    Field(const Field &) = delete;
    const brume_grid_info &info() const { return grid->info; }
    float at(int x, int y, int z, int channel = 0) const
    {
        const auto &dims = grid->info.dims;
        return grid
            ->data[((int64_t(z) * dims[1] + y) * dims[0] + x) * grid->info.channels + channel];
    }
    double sum() const
    {
        double sum = 0.0;
        const auto &dims = grid->info.dims;
        for (int64_t i = 0; i < int64_t(dims[0]) * dims[1] * dims[2] * info().channels; ++i)
            sum += grid->data[i];
        return sum;
    }
};

static void expect_refusal(const char *file, const char *name, brume_result code,
                           const std::vector<const char *> &words)
{
    brume_grid *grid = nullptr;
    const brume_result result = vdb_load(in_folder(file).c_str(), name, 0, false, &grid);
    if (result != code)
        fail_msg("'%s': result %d, not %d: %s", name, result, code, last_error());
    assert_null(grid);
    assert_non_null(std::strstr(last_error(), file));
    for (const char *word : words)
        if (!std::strstr(last_error(), word))
            fail_msg("no '%s' in '%s'", word, last_error());
}

static std::vector<char> slurp()
{
    std::ifstream file(in_folder("a.vdb"), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

static void spill(const std::vector<char> &bytes, const char *name = "bad.vdb")
{
    std::ofstream file(in_folder(name), std::ios::binary);
    file.write(bytes.data(), std::streamsize(bytes.size()));
}

/* Puts `to` in the place of every `from`; gives how many there were. */
template <class T> static int patch(std::vector<char> &bytes, const T &from, const T &to)
{
    int count = 0;
    for (size_t at = 0; at + sizeof from <= bytes.size(); ++at) {
        if (std::memcmp(bytes.data() + at, &from, sizeof from) == 0) {
            std::memcpy(bytes.data() + at, &to, sizeof to);
            ++count;
        }
    }
    return count;
}

/* Values that a half holds exactly, in and around several leaves, with negative coordinates. */
static float pattern(int x, int y, int z)
{
    return float((x * 7 + y * 3 + z) % 64) * 0.25f + 0.125f;
}

template <class Grid> static typename Grid::Ptr make_pattern(const char *name)
{
    using T = typename Grid::ValueType;
    auto grid = make<Grid>(name);
    auto &tree = grid->tree();
    for (int x = -5; x < 14; ++x)
        for (int y = -3; y < 6; ++y)
            for (int z = 2; z < 21; ++z)
                if ((x + y + z) % 3 == 0) {
                    const float value = pattern(x + 5, y + 3, z);
                    if constexpr (openvdb::VecTraits<T>::IsVec) {
                        using S = typename T::value_type;
                        tree.setValue(Coord(x, y, z), T(S(value), S(2 * value), S(-value)));
                    } else if constexpr (std::is_same_v<T, bool>) {
                        tree.setValue(Coord(x, y, z), (x ^ y) & 1);
                    } else {
                        tree.setValue(Coord(x, y, z), T(value));
                    }
                }
    /* Inactive, whatever it holds. */
    tree.setValueOff(Coord(0, 0, 4), T(tree.getValue(Coord(0, 0, 3))));
    return grid;
}

template <class Grid> static void check_pattern(const char *type, bool half)
{
    using T = typename Grid::ValueType;
    const auto grid = make_pattern<Grid>("g");
    grid->setSaveFloatAsHalf(half);
    for (uint32_t compression = 0; compression < 8; ++compression) {
        write({grid}, compression);
        const Field field("g");
        const brume_grid_info &info = field.info();
        assert_string_equal(info.name, "g");
        assert_string_equal(info.type, type);
        assert_int_equal(info.channels, openvdb::VecTraits<T>::Size);
        const CoordBBox box = grid->evalActiveVoxelBoundingBox();
        for (int axis = 0; axis < 3; ++axis) {
            assert_int_equal(info.dims[axis], box.dim()[axis]);
            assert_int_equal(info.file_dims[axis], box.dim()[axis]);
        }
        assert_int_equal(info.reduction, 1);
        const auto &tree = grid->tree();
        float least = std::numeric_limits<float>::max(), most = -least;
        for (int x = 0; x < info.dims[0]; ++x)
            for (int y = 0; y < info.dims[1]; ++y)
                for (int z = 0; z < info.dims[2]; ++z)
                    for (int c = 0; c < info.channels; ++c) {
                        const Coord at = box.min() + Coord(x, y, z);
                        const T value = tree.getValue(at);
                        float expected = 0.0f;
                        if (tree.isValueOn(at)) {
                            if constexpr (openvdb::VecTraits<T>::IsVec)
                                expected = float(value[c]);
                            else
                                expected = float(value);
                        }
                        least = std::min(least, expected);
                        most = std::max(most, expected);
                        if (field.at(x, y, z, c) != expected)
                            fail_msg("%s, compression %u, voxel %d %d %d: %g, not %g", type,
                                     compression, x, y, z, double(field.at(x, y, z, c)),
                                     double(expected));
                    }
        assert_true(info.minimum == least && info.maximum == most);
    }
}

static void test_types(void **)
{
    check_pattern<openvdb::FloatGrid>("float", false);
    check_pattern<openvdb::FloatGrid>("half", true);
    check_pattern<openvdb::DoubleGrid>("double", false);
    check_pattern<openvdb::DoubleGrid>("half", true);
    check_pattern<openvdb::Int32Grid>("int32", false);
    check_pattern<openvdb::Int64Grid>("int64", false);
    check_pattern<openvdb::BoolGrid>("bool", false);
    check_pattern<openvdb::Vec3SGrid>("vec3s", false);
    check_pattern<openvdb::Vec3SGrid>("vec3h", true);
    check_pattern<openvdb::Vec3DGrid>("vec3d", false);
    check_pattern<openvdb::Vec3IGrid>("vec3i", false);

    auto mask = make<openvdb::MaskGrid>("mask");
    mask->tree().setValueOn(Coord(3, 4, 5));
    mask->tree().setValueOn(Coord(3, 4, 9));
    write(mask);
    const Field field("mask");
    assert_string_equal(field.info().type, "mask");
    assert_int_equal(field.info().dims[2], 5);
    assert_true(field.at(0, 0, 0) == 1.0f && field.at(0, 0, 4) == 1.0f && field.sum() == 2.0);
}

/* Tiles of every level, clipped by nothing, beside single voxels; inactive tiles do not count. */
static void test_tiles(void **)
{
    auto grid = make<openvdb::FloatGrid>("density");
    grid->tree().addTile(1, Coord(-8, 0, 0), 2.0f, true);
    grid->tree().addTile(1, Coord(16, 8, 0), 3.0f, false);
    grid->tree().addTile(2, Coord(128, 0, 0), 0.5f, true);
    grid->tree().setValue(Coord(3, 1, 2), 7.0f);
    write(grid);
    const Field field("density");
    assert_int_equal(field.info().dims[0], 8 + 256);
    assert_int_equal(field.info().dims[1], 128);
    assert_int_equal(field.info().dims[2], 128);
    assert_true(field.at(0, 0, 0) == 2.0f && field.at(7, 7, 7) == 2.0f);
    assert_true(field.at(8, 0, 0) == 0.0f && field.at(24, 8, 0) == 0.0f);
    assert_true(field.at(11, 1, 2) == 7.0f && field.at(8 + 128, 0, 0) == 0.5f);
    assert_true(field.at(263, 127, 127) == 0.5f);
    assert_true(field.sum() == 2.0 * 512 + 7.0 + 0.5 * 128 * 128 * 128);
}

/* Means over cubes, checked voxel by voxel against the tree. */
static void test_reduction(void **)
{
    auto grid = make<openvdb::FloatGrid>("density");
    grid->tree().root().setBackground(5.0f, false); /* must not count */
    std::mt19937 random(1);
    for (int i = 0; i < 4000; ++i) {
        const int x = int(random() % 90) - 37, y = int(random() % 50) + 3, z = int(random() % 70);
        grid->tree().setValue(Coord(x, y, z), float(random() % 1000));
    }
    grid->tree().addTile(1, Coord(8, 16, 24), 100.0f, true);
    grid->tree().addTile(1, Coord(-32, 40, 8), 10.0f, true);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    write(grid);

    const CoordBBox box = grid->evalActiveVoxelBoundingBox();
    const auto &tree = grid->tree();
    for (const uint64_t limit : {100000, 40000, 3000, 100, 8, 1}) {
        const Field field("density", limit);
        const brume_grid_info &info = field.info();
        const int r = info.reduction;
        uint64_t held = 1, finer = 1;
        for (int axis = 0; axis < 3; ++axis) {
            assert_int_equal(info.file_dims[axis], box.dim()[axis]);
            assert_int_equal(info.dims[axis], (box.dim()[axis] + r - 1) / r);
            held *= uint64_t(info.dims[axis]);
            finer *= uint64_t((box.dim()[axis] + r - 2) / (r - 1));
        }
        assert_true(r > 1 && held <= limit && finer > limit);
        for (int x = 0; x < info.dims[0]; ++x)
            for (int y = 0; y < info.dims[1]; ++y)
                for (int z = 0; z < info.dims[2]; ++z) {
                    double sum = 0.0;
                    for (int i = 0; i < r; ++i)
                        for (int j = 0; j < r; ++j)
                            for (int k = 0; k < r; ++k) {
                                const Coord at = box.min() + Coord(x * r + i, y * r + j, z * r + k);
                                if (tree.isValueOn(at))
                                    sum += double(tree.getValue(at));
                            }
                    const double mean = sum / (double(r) * r * r);
                    /* Sums of leaves are rounded to floats, a few dozen of them. */
                    if (std::abs(field.at(x, y, z) - mean) > 1e-5 * mean)
                        fail_msg("reduction %d, voxel %d %d %d: %g, not %g", r, x, y, z,
                                 double(field.at(x, y, z)), mean);
                }
        /* The array's corner stays where it was, its voxels grow. */
        assert_true(info.object_from_array[0] == 0.5f * float(r));
        assert_true(info.object_from_array[12] == 0.5f * (float(box.min().x()) - 0.5f));
    }
}

static double seconds_since(std::chrono::steady_clock::time_point start)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/* Boxes that no machine holds: the time goes with what is active. */
static void test_wide(void **)
{
    auto grid = make<openvdb::FloatGrid>("density");
    grid->tree().setValue(Coord(0, 0, 0), 8.0f);
    grid->tree().setValue(Coord(999999, 999999, 999999), 4.0f);
    write(grid);
    const auto start = std::chrono::steady_clock::now();
    {
        const Field field("density");
        assert_true(field.info().reduction == 1954); /* 512^3 of them are 2^27 */
        assert_true(field.info().file_dims[0] == 1000000);
        assert_true(field.info().dims[0] == 512);
        const double volume = 1954.0 * 1954.0 * 1954.0;
        assert_true(std::abs(field.at(0, 0, 0) - 8.0 / volume) < 1e-6 * 8.0 / volume);
        assert_true(std::abs(field.at(511, 511, 511) - 4.0 / volume) < 1e-6 * 4.0 / volume);
    }
    {
        const Field field("density", 1000);
        assert_true(field.info().dims[0] == 10 && field.info().reduction == 100000);
    }
    /* Walking 10^18 voxels takes years; even 2^27 held ones take a second under the sanitizers. */
    assert_true(seconds_since(start) < 60.0);

    /* A row one voxel thick, and the ends of the number range. */
    grid->clear();
    grid->tree().setValue(Coord(-1000000, 5, 5), 3.0f);
    grid->tree().setValue(Coord(1000000, 5, 5), 1.0f);
    write(grid);
    {
        const Field field("density", 1000);
        assert_int_equal(field.info().dims[1], 1);
        assert_int_equal(field.info().dims[2], 1);
        assert_true(field.info().reduction == 2001);
        assert_int_equal(field.info().dims[0], 1000);
    }
    grid->clear();
    grid->tree().setValue(Coord(INT_MIN, INT_MIN, INT_MAX), 3.0f);
    grid->tree().setValue(Coord(INT_MAX, INT_MAX, INT_MIN), 1.0f);
    write(grid);
    {
        const Field field("density", 1000);
        assert_true(field.info().file_dims[0] == int64_t{1} << 32);
        assert_int_equal(field.info().dims[2], 10);
        assert_true(field.at(0, 0, 9) > 0.0f && field.at(9, 9, 0) > 0.0f);
        assert_true(field.at(0, 0, 0) == 0.0f);
    }
    expect_refusal("a.vdb", "densit", BRUME_E_GRID_UNKNOWN, {"'density'"});
    brume_grid *none = nullptr;
    assert_int_equal(vdb_load(in_folder("a.vdb").c_str(), "density", 1, false, &none),
                     BRUME_E_MEMORY);
}

static void test_huge_tile(void **)
{
    auto grid = make<openvdb::FloatGrid>("density");
    grid->tree().root().addTile(Coord(-4096, 0, 4096), 2.5f, true);
    write(grid);
    const Field field("density", 1 << 20);
    assert_true(field.info().file_dims[0] == 4096);
    assert_int_equal(field.info().reduction, 41);
    assert_int_equal(field.info().dims[0], 100);
    assert_true(std::abs(field.at(50, 50, 50) - 2.5f) < 1e-6f);
    /* Of the last cells 37 of 41 voxels are in the box. */
    assert_true(std::abs(field.at(99, 50, 50) - 2.5f * 37 / 41) < 1e-5f);
    assert_true(std::abs(field.sum() * 41 * 41 * 41 - 2.5 * 4096.0 * 4096.0 * 4096.0) <
                1e-5 * 2.5 * 4096.0 * 4096.0 * 4096.0);

    /* One that takes the last coordinates there are. */
    grid->clear();
    grid->tree().root().addTile(Coord(INT_MAX - 4095, INT_MIN, 0), 1.0f, true);
    write(grid);
    const Field edge("density", 4096);
    assert_int_equal(edge.info().dims[1], 16);
    assert_true(edge.at(15, 0, 0) == 1.0f && edge.info().minimum == 1.0f);
}

/* --- Transforms ---------------------------------------------------------------------------- */

static void check_transform(const openvdb::math::Transform::Ptr &transform)
{
    auto grid = make<openvdb::FloatGrid>("density");
    grid->setTransform(transform);
    grid->tree().setValue(Coord(-7, 11, 30), 1.0f);
    grid->tree().setValue(Coord(5, 13, 37), 2.0f);
    write(grid);
    brume_grid_info listed;
    uint32_t count = 0;
    assert_int_equal(vdb_list(in_folder("a.vdb").c_str(), &listed, 1, &count), BRUME_OK);
    assert_int_equal(listed.supported, 1);
    for (const int i : {0, 1, 2, 3}) {
        const uint64_t limit = i % 2 ? 20 : 0;
        const bool at_corner = i >= 2;
        const Field field("density", limit, "a.vdb", at_corner);
        const float *m = field.info().object_from_array;
        const int r = field.info().reduction;
        assert_int_equal(r > 1, limit != 0);
        if (i == 0)
            assert_memory_equal(m, listed.object_from_array, 16 * sizeof(float));
        for (const Vec3d &array : {Vec3d(0, 0, 0), Vec3d(1, 2, 3), Vec3d(-4, 9.5, 0.25)}) {
            /* The corner of voxel (-7, 11, 30) is half a voxel below its centre. */
            const Vec3d index = Vec3d(-7, 11, 30) - Vec3d(at_corner ? 0.0 : 0.5) + array * r;
            const Vec3d expected = transform->indexToWorld(index);
            /* Floats: a few roundings of the largest term. */
            const double scale =
                1.0 + expected.length() + transform->indexToWorld(Vec3d(0)).length();
            for (int row = 0; row < 3; ++row) {
                const double got = m[row] * array[0] + m[4 + row] * array[1] +
                                   m[8 + row] * array[2] + double(m[12 + row]);
                if (std::abs(got - expected[row]) > 1e-5 * scale)
                    fail_msg("row %d: %g, not %g", row, got, expected[row]);
            }
        }
        assert_true(m[3] == 0.0f && m[7] == 0.0f && m[11] == 0.0f && m[15] == 1.0f);
    }
}

static void test_transforms(void **)
{
    using openvdb::math::Transform;
    check_transform(Transform::createLinearTransform(0.25)); /* UniformScaleMap */
    check_transform(Transform::createLinearTransform(1e-4)); /* small, not singular */
    auto t = Transform::createLinearTransform(1.0);
    t->preScale(Vec3d(0.5, 2.0, 3.0)); /* ScaleMap */
    check_transform(t);
    t->postTranslate(Vec3d(10, -20, 3)); /* ScaleTranslateMap */
    check_transform(t);
    t = Transform::createLinearTransform(0.5);
    t->postTranslate(Vec3d(1, 2, 3)); /* UniformScaleTranslateMap */
    check_transform(t);
    check_transform(Transform::Ptr(new Transform(
        openvdb::math::MapBase::Ptr(new openvdb::math::TranslationMap(Vec3d(4, 5, 6))))));
    check_transform(Transform::Ptr(new Transform(
        openvdb::math::MapBase::Ptr(new openvdb::math::UnitaryMap(Vec3d(1, 1, 0).unit(), 0.7)))));
    t = Transform::createLinearTransform(1.0);
    t->preScale(Vec3d(0.5, 2.0, 0.1));
    t->postRotate(0.6, openvdb::math::X_AXIS);
    t->postRotate(-1.1, openvdb::math::Z_AXIS);
    t->postShear(0.3, openvdb::math::X_AXIS, openvdb::math::Y_AXIS);
    t->postTranslate(Vec3d(-3, 100, 7)); /* AffineMap */
    check_transform(t);
    t->postScale(Vec3d(-1, 1, 1)); /* mirrored */
    check_transform(t);
}

static void test_transform_refusals(void **)
{
    using openvdb::math::Transform;
    auto grid = make<openvdb::FloatGrid>("density");
    grid->tree().setValue(Coord(1, 2, 3), 1.0f);
    grid->setTransform(Transform::createFrustumTransform(
        openvdb::BBoxd(Vec3d(0), Vec3d(10, 10, 10)), 0.5, 10.0, 0.1));
    write(grid);
    expect_refusal("a.vdb", "density", BRUME_E_TRANSFORM, {"'density'", "not linear"});
    brume_grid_info info;
    uint32_t count;
    assert_int_equal(vdb_list(in_folder("a.vdb").c_str(), &info, 1, &count), BRUME_OK);
    assert_int_equal(info.supported, 0);

    auto t = Transform::createLinearTransform(1.0);
    t->preScale(Vec3d(0.3125, 2.0, 3.0));
    grid->setTransform(t);
    write(grid);
    const std::vector<char> good = slurp();
    for (const double value : {0.0, double(NAN), double(INFINITY), 1e200, 1e-200}) {
        std::vector<char> bytes = good;
        assert_true(patch(bytes, 0.3125, value) >= 1);
        spill(bytes);
        expect_refusal("bad.vdb", "density", BRUME_E_TRANSFORM, {"'density'", "singular"});
    }

    t->postRotate(0.5, openvdb::math::X_AXIS);
    t->postTranslate(Vec3d(0.15625, 0, 0));
    grid->setTransform(t);
    write(grid);
    std::vector<char> bytes = slurp();
    const double last_row[2] = {0.0, 1.0}, perspective[2] = {0.0, 2.0};
    assert_true(patch(bytes, last_row, perspective) >= 1);
    spill(bytes);
    expect_refusal("bad.vdb", "density", BRUME_E_TRANSFORM, {"'density'", "not linear"});
}

/* --- Lists, names, refusals ---------------------------------------------------------------- */

static void test_list(void **)
{
    auto density = make_pattern<openvdb::FloatGrid>("density");
    auto again = make<openvdb::FloatGrid>("density");
    again->tree().setValue(Coord(1, 1, 1), 9.0f);
    auto velocity = make_pattern<openvdb::Vec3SGrid>("velocity");
    auto heat = make_pattern<openvdb::FloatGrid>("heat");
    heat->setSaveFloatAsHalf(true);
    auto shell = make_pattern<openvdb::FloatGrid>("shell");
    shell->setGridClass(openvdb::GRID_LEVEL_SET);
    auto points = openvdb::GridBase::createGrid("Tree_ptdataidx32_5_4_3");
    points->setName("drops");
    auto nothing = make<openvdb::FloatGrid>("nothing");
    auto longest = make<openvdb::Vec3IGrid>(std::string(90, 'x').c_str());
    longest->tree().setValue(Coord(0), openvdb::Vec3i(1, 2, 3));
    const openvdb::GridPtrVec grids = {density, again,  velocity, heat,
                                       shell,   points, nothing,  longest};

    for (const bool statistics : {true, false}) {
        write(grids, openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK, statistics);
        const std::string path = in_folder("a.vdb");
        uint32_t count = 0;
        brume_grid_info infos[8];
        assert_int_equal(vdb_list(path.c_str(), nullptr, 0, &count), BRUME_OK);
        assert_int_equal(count, 8);
        std::memset(infos, 0x5a, sizeof infos);
        assert_int_equal(vdb_list(path.c_str(), infos, 2, &count), BRUME_OK);
        assert_int_equal(count, 8);
        assert_int_equal(infos[2].channels, 0x5a5a5a5a); /* only as many as asked for */
        assert_int_equal(vdb_list(path.c_str(), infos, 8, &count), BRUME_OK);
        const struct {
            const char *name, *type;
            int channels, supported, dim;
        } expected[] = {{"density[0]", "float", 1, 1, 19}, {"density[1]", "float", 1, 1, 1},
                        {"velocity", "vec3s", 3, 1, 19},   {"heat", "half", 1, 1, 19},
                        {"shell", "ls_float", 0, 0, -1},   {"drops", "points", 0, 0, -1},
                        {"nothing", "float", 1, 1, 0},     {nullptr, "vec3i", 3, 1, 1}};
        for (const auto &line : expected) {
            const brume_grid_info *info = nullptr;
            for (const brume_grid_info &one : infos)
                if (line.name ? std::strcmp(one.name, line.name) == 0 : std::strlen(one.name) == 63)
                    info = &one;
            if (!info)
                fail_msg("%s is not listed", line.name ? line.name : "the long name");
            assert_string_equal(info->type, line.type);
            assert_int_equal(info->channels, line.channels);
            assert_int_equal(info->supported, line.supported);
            assert_int_equal(info->reduction, 1);
            if (line.dim >= 0)
                assert_int_equal(info->file_dims[0], line.dim);
        }
        {
            const Field first("density"), second("density[1]"), last(infos[7].name);
            assert_int_equal(first.info().dims[0], 19);
            assert_true(second.at(0, 0, 0) == 9.0f && last.at(0, 0, 0, 2) == 3.0f);
        }
        expect_refusal("a.vdb", "shell", BRUME_E_GRID_TYPE, {"'shell'", "ls_float"});
        expect_refusal("a.vdb", "drops", BRUME_E_GRID_TYPE, {"'drops'", "points"});
        expect_refusal("a.vdb", "nothing", BRUME_E_GRID_EMPTY, {"'nothing'"});
        expect_refusal("a.vdb", "smoke", BRUME_E_GRID_UNKNOWN,
                       {"'smoke'", "'velocity'", "'heat'", "'drops'"});
    }

    /* A file that lies about its box. */
    write({again}, 0);
    std::vector<char> bytes = slurp();
    const int32_t corner[3] = {1, 1, 1}, far_away[3] = {100, 200, 300};
    assert_true(patch(bytes, corner, far_away) >= 1);
    spill(bytes);
    const Field field("density", 0, "bad.vdb");
    assert_true(field.info().file_dims[0] == 1 && field.at(0, 0, 0) == 9.0f);
}

/* Two grids that share one tree: the second is stored as a reference. */
static void test_instance(void **)
{
    auto first = make_pattern<openvdb::FloatGrid>("first");
    auto second = make<openvdb::FloatGrid>("second");
    second->setTree(first->treePtr());
    second->setTransform(openvdb::math::Transform::createLinearTransform(3.0));
    write({first, second}, openvdb::io::COMPRESS_ACTIVE_MASK);
    const Field a("first"), b("second");
    assert_int_equal(a.info().dims[0], b.info().dims[0]);
    assert_true(a.sum() == b.sum());
    assert_true(b.info().object_from_array[0] == 3.0f && a.info().object_from_array[0] == 1.0f);
}

static void test_values(void **)
{
    auto grid = make<openvdb::FloatGrid>("density");
    for (int i = 0; i < 100; ++i)
        grid->tree().setValue(Coord(i, 0, 0), i % 10 == 3 ? NAN : i % 50 == 7 ? INFINITY : 1.0f);
    write(grid);
    expect_refusal("a.vdb", "density", BRUME_E_GRID_VALUES, {"'density'", "12 NaN"});

    auto wide = make<openvdb::DoubleGrid>("wide");
    wide->tree().setValue(Coord(0), 1e300); /* no float */
    write(wide);
    expect_refusal("a.vdb", "wide", BRUME_E_GRID_VALUES, {"'wide'", "1 NaN"});

    auto tile = make<openvdb::Vec3SGrid>("tile");
    tile->tree().addTile(1, Coord(0), openvdb::Vec3s(1, NAN, 1), true);
    write(tile);
    expect_refusal("a.vdb", "tile", BRUME_E_GRID_VALUES, {"'tile'", "1 NaN"});

    /* Inactive ones and the background do no harm. */
    auto hidden = make<openvdb::FloatGrid>("hidden");
    hidden->tree().root().setBackground(NAN, false);
    hidden->tree().setValue(Coord(0), 2.0f);
    hidden->tree().setValueOff(Coord(3, 0, 0), INFINITY);
    write(hidden);
    const Field field("hidden");
    assert_true(field.at(0, 0, 0) == 2.0f && field.info().dims[0] == 1);
}

static void test_not_a_file(void **)
{
    expect_refusal("none.vdb", "density", BRUME_E_FILE_MISSING, {"No such file"});
    expect_refusal("", "density", BRUME_E_FILE_MISSING, {"not a file"});
    assert_int_equal(mkfifo(in_folder("pipe.vdb").c_str(), 0600), 0);
    expect_refusal("pipe.vdb", "density", BRUME_E_FILE_MISSING, {"not a file"});
    spill({}, "empty.vdb");
    expect_refusal("empty.vdb", "density", BRUME_E_FILE_FORMAT, {"too short"});
    const std::string text = "This is a letter, not a volume.\n";
    spill({text.begin(), text.end()}, "text.vdb");
    expect_refusal("text.vdb", "density", BRUME_E_FILE_FORMAT, {"no OpenVDB file"});
    uint32_t count = 77;
    assert_int_equal(vdb_list(in_folder("text.vdb").c_str(), nullptr, 0, &count),
                     BRUME_E_FILE_FORMAT);
    assert_int_equal(count, 77);
    assert_int_equal(vdb_list(nullptr, nullptr, 0, &count), BRUME_E_ARGUMENT);
    brume_grid *grid = nullptr;
    assert_int_equal(vdb_load(in_folder("text.vdb").c_str(), nullptr, 0, false, &grid),
                     BRUME_E_ARGUMENT);
}

/* --- Damage -------------------------------------------------------------------------------- */

/* Lists and loads in a child with bounded memory, so that a crash or a giant allocation is one
 * failed trial: 0 loaded, 1 refused with a sentence that names the file, else trouble. */
static int load_in_child(const std::vector<const char *> &names)
{
    const pid_t child = fork();
    if (child == 0) {
        const rlim_t most = rlim_t{3} << 30;
        const struct rlimit limit = {most, most};
        if (!SANITIZED)
            setrlimit(RLIMIT_AS, &limit);
        alarm(60);
        const std::string path = in_folder("bad.vdb");
        brume_grid_info infos[8];
        uint32_t count;
        int status = vdb_list(path.c_str(), infos, 8, &count) == BRUME_OK ? 0 : 1;
        for (const char *name : names) {
            brume_grid *grid = nullptr;
            if (vdb_load(path.c_str(), name, 1 << 22, false, &grid) == BRUME_OK)
                field_release(grid);
            else
                status = std::strstr(last_error(), "bad.vdb") ? 1 : 2;
        }
        _exit(status);
    }
    int status;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static void damage(const openvdb::GridPtrVec &grids, uint32_t compression, int flips)
{
    write(grids, compression);
    const std::vector<char> good = slurp();
    std::vector<const char *> names;
    std::vector<std::string> kept_names;
    for (const auto &grid : grids)
        kept_names.push_back(grid->getName());
    for (const std::string &name : kept_names)
        names.push_back(name.c_str());

    spill(good);
    assert_int_equal(load_in_child(names), 0);
    for (int i = 0; i < 60; ++i) {
        const size_t keep = i == 0 ? good.size() - 1 : good.size() * size_t(i - 1) / 60;
        spill({good.begin(), good.begin() + std::ptrdiff_t(keep)});
        const int status = load_in_child(names);
        if (status != 1)
            fail_msg("cut to %zu of %zu bytes: status %d", keep, good.size(), status);
    }
    std::mt19937 random(compression + 1);
    int refused = 0;
    for (int i = 0; i < flips; ++i) {
        std::vector<char> bytes = good;
        /* Every other one where the table and the heads are. */
        const size_t range = i % 2 ? bytes.size() : std::min<size_t>(bytes.size(), 2000);
        for (int k = 0; k <= i % 3; ++k)
            bytes[random() % range] ^= char(1 << random() % 8);
        spill(bytes);
        const int status = load_in_child(names);
        if (status > 1)
            fail_msg("compression %u, trial %d of damage: status %d", compression, i, status);
        refused += status;
    }
    assert_true(refused > 0);
}

static void test_damaged(void **)
{
    using namespace openvdb::io;
    auto density = make_pattern<openvdb::FloatGrid>("density");
    density->tree().addTile(1, Coord(64, 0, 0), 2.0f, true);
    auto half = make_pattern<openvdb::FloatGrid>("half");
    half->setSaveFloatAsHalf(true);
    auto velocity = make_pattern<openvdb::Vec3SGrid>("velocity");
    auto mask = make_pattern<openvdb::BoolGrid>("mask");
    const openvdb::GridPtrVec grids = {density, half, velocity, mask};
    damage(grids, COMPRESS_NONE, 50);
    damage(grids, COMPRESS_ACTIVE_MASK, 50);
    damage(grids, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK, 70);
    damage(grids, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK, 70);
}

/* What made OpenVDB write or read beyond its buffers: lengths of blocks, and lengths of strings. */
static void test_lengths(void **)
{
    using namespace openvdb::io;
    for (const uint32_t compression : {uint32_t(COMPRESS_ZIP), uint32_t(COMPRESS_BLOSC)}) {
        auto grid = make<openvdb::FloatGrid>("density");
        std::mt19937 random(3);
        for (int i = 0; i < 512; ++i) { /* noise does not shrink: stored as it is */
            const uint32_t bits = (random() & 0x007fffff) | 0x3f800000;
            float value;
            std::memcpy(&value, &bits, sizeof value);
            grid->tree().setValue(Coord(i >> 6, i >> 3 & 7, i & 7), value);
        }
        write({grid}, compression);
        const std::vector<char> good = slurp();
        for (size_t at = 0; at + 8 <= good.size(); ++at) {
            int64_t length;
            std::memcpy(&length, good.data() + at, sizeof length);
            const bool plain = length == -2048, packed = length > 16 && length < 40000;
            if (!plain && !packed)
                continue;
            for (const int64_t wrong : {-(int64_t{1} << 30), INT64_MIN, INT64_MAX, int64_t{-2052},
                                        int64_t{1} << 40, int64_t{0}, length - 1, length + 1}) {
                std::vector<char> bytes = good;
                std::memcpy(bytes.data() + at, &wrong, sizeof wrong);
                spill(bytes);
                const int status = load_in_child({"density"});
                if (status > 1 || (plain && status != 1))
                    fail_msg("length %lld instead of %lld: status %d", (long long)wrong,
                             (long long)length, status);
            }
        }
        for (size_t at = 0; at + 4 <= std::min<size_t>(good.size(), 1500); ++at) {
            const uint32_t giant = 0xfffffff0u;
            std::vector<char> bytes = good;
            std::memcpy(bytes.data() + at, &giant, sizeof giant);
            if (at % (SANITIZED ? 16 : 4))
                continue;
            spill(bytes);
            const int status = load_in_child({"density"});
            if (status > 1)
                fail_msg("giant number at byte %zu: status %d", at, status);
        }
    }
}

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_types, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_tiles, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_reduction, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_wide, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_huge_tile, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_transforms, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_transform_refusals, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_list, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_instance, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_values, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_not_a_file, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_damaged, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_lengths, make_folder, remove_folder),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
