// SPDX-License-Identifier: GPL-3.0-or-later
// The light that was scattered or reflected, as the view takes it from its lattice.
#include "lib/cuts.glsl"

layout(binding = SLOT_FIELD) uniform sampler3D field_lattice; // as lpv_finish leaves it
layout(binding = SLOT_SCATTERED) uniform sampler3D scattered_lattice; // DOM's
layout(binding = SLOT_BAND_2) uniform sampler3D band_2; // DOM's: moments of the same light

struct field_light
{
    vec3 fluence; // W/m^2
    mat3 flux;    // columns: colours; where the light goes
    vec3 second[BAND_2]; // moments of band 2, 0 where they are not asked for
};

const field_light DARK = field_light(vec3(0.0), mat3(0.0), vec3[](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)));

bool field_exists()
{
    return frame.field.x != 0;
}

// Where a cell's colours are in the texture: 0 to 2, or what parts it from others: 3.
ivec3 texel_of(gpu_field field, ivec3 cell, int number)
{
    return cell + ivec3(number * field.dims.x, 0, field.dims.w);
}

// The cell on whose side of the surfaces a point is: the nearest, or along an axis the one that no
// cut lies before. `low`: the cell before it on all axes, f: how far it is on the way to the next.
// Twice around the axes: in a corner the nearest cell may be behind a wall, and know nothing of the
// others there.
ivec3 home_of(gpu_field field, ivec3 low, vec3 f, ivec3 last)
{
    ivec3 home = low + ivec3(step(0.5, f));
    for (int i = 0; i < 6; ++i) {
        int axis = i % 3;
        ivec3 before = home;
        before[axis] = low[axis];
        if (any(lessThan(before, ivec3(0))) || any(greaterThan(before, last)))
            continue;
        uint where = uint(texelFetch(field_lattice, texel_of(field, before, 3), 0).z) >> (8 * axis) &
                     255u;
        bool beyond = where != 0u ? f[axis] * 253.0 + 1.0 >= float(where) + 0.5 : f[axis] >= 0.5;
        home[axis] = low[axis] + int(beyond);
    }
    return clamp(home, ivec3(0), last);
}

void add_cell(inout field_light light, gpu_field field, ivec3 cell, float weight, bool second)
{
    for (int c = 0; c < 3; ++c) {
        vec4 texel = texelFetch(field_lattice, texel_of(field, cell, c), 0);
        light.fluence[c] += weight * texel.x;
        light.flux[c] += weight * texel.yzw;
    }
    if (second)
        for (int m = 0; m < BAND_2; ++m)
            light.second[m] += weight * texelFetch(band_2, texel_of(field, cell, m), 0).rgb;
}

void add_light(inout field_light light, field_light other, float share)
{
    light.fluence += share * other.fluence;
    light.flux += share * other.flux;
    for (int m = 0; m < BAND_2; ++m)
        light.second[m] += share * other.second[m];
}

// The links of a cell that surfaces cut.
uint cuts_of(gpu_field field, ivec3 cell)
{
    vec2 sides = texelFetch(field_lattice, texel_of(field, cell, 3), 0).xy;
    return uint(sides.x) | uint(sides.y) << 13;
}

// The eight cells around a point.
struct cells_between
{
    ivec3 low, last; // the one before it on all axes; the lattice's last
    vec3 f;          // how far the point is from there to the next
    ivec3 home;      // the one that it belongs to, and the links of that that are cut
    uint cuts;
};

cells_between cells_around(gpu_field field, vec3 p)
{
    vec3 at = (p - field.lower.xyz) / field.lower.w - 0.5;
    cells_between cells;
    cells.last = field.dims.xyz - 1;
    cells.low = ivec3(floor(at));
    cells.f = at - vec3(cells.low);
    cells.home = home_of(field, cells.low, cells.f, cells.last);
    cells.cuts = cuts_of(field, cells.home);
    return cells;
}

// How much one of them, by its corner, counts at the point: nothing where a surface parts it from the
// cell that the point belongs to, or it is not before the plane (xyz: normal, w: its points' product
// with that).
float share_of_cell(cells_between cells, gpu_field field, int corner, vec4 plane, out ivec3 cell)
{
    ivec3 side = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    cell = clamp(cells.low + side, ivec3(0), cells.last);
    vec3 each = mix(1.0 - cells.f, cells.f, vec3(side));
    // A cell that more links to are cut than to one where three walls meet is within something small,
    // and tells nothing.
    bool within = bitCount(cells.cuts) > 19;
    bool parted = within ? cell == cells.home : is_cut(cells.cuts, cell - cells.home);
    return parted || dot(cell_centre(field, cell), plane.xyz) < plane.w ? 0.0
                                                                        : each.x * each.y * each.z;
}

// Interpolated between the eight cells around a point.
field_light field_between(gpu_field field, cells_between cells, vec4 plane, bool second)
{
    field_light light = DARK, whole = DARK;
    float sum = 0.0;
    int corners = 8 * min(frame.field.x, 1); // not unrolled, which would take seconds to compile
    int corner = 0;
    do {
        ivec3 cell;
        float weight = share_of_cell(cells, field, corner, plane, cell);
        if (weight <= 0.0)
            continue;
        sum += weight;
        add_cell(light, field, cell, weight, second);
    } while (++corner < corners);
    if (sum > 1e-3) {
        add_light(whole, light, 1.0 / sum);
        return whole;
    }
    add_cell(whole, field, cells.home, 1.0, second);
    return whole;
}

// The field ends where its largest lattice does.
bool field_reaches(vec3 p)
{
    gpu_field field = frame.fields[0];
    vec3 at = (p - field.lower.xyz) / field.lower.w;
    return all(greaterThan(at, vec3(0.0))) && all(lessThan(at, vec3(field.dims.xyz)));
}

// Beyond it light goes on from where it left the lattice: the point there, and how much of it is left.
// Light of something in the lattice's middle, on a ground, falls with the third power of the distance.
// Nothing is left where a surface stands between.
vec3 field_leaves(vec3 p, out float left)
{
    gpu_field field = frame.fields[0];
    vec3 half_ = 0.5 * vec3(field.dims.xyz) * field.lower.w, middle = field.lower.xyz + half_;
    vec3 room = half_ - 0.5 * field.lower.w;
    vec3 q = middle + clamp(p - middle, -room, room);
    vec3 off = p - q;
    ivec3 beyond = ivec3(sign(off)) * ivec3(greaterThan(abs(off), vec3(0.5 * field.lower.w)));
    left = 1.0;
    if (beyond == ivec3(0))
        return p;
    ivec3 cell = clamp(ivec3((q - field.lower.xyz) / field.lower.w), ivec3(0), field.dims.xyz - 1);
    left = is_cut(cuts_of(field, cell), beyond) ? 0.0 : pow(length(q - middle) / length(p - middle), 3.0);
    return q;
}

// Of the light at a point, the share that a lattice within another tells: it gives way to that one in
// its outermost cells, so that no seam shows.
float share_of(gpu_field field, vec3 p)
{
    vec3 inside = min(p - field.keep_lower.xyz, field.keep_upper.xyz - p);
    return clamp(min(inside.x, min(inside.y, inside.z)) / (float(FIELD_GIVES_WAY) * field.lower.w), 0.0, 1.0);
}

// Length of the cells that tell the light at a point.
float field_cell(vec3 p)
{
    float left = 1.0, length_ = 0.0;
    int number = max(frame.field.x - 1, 0);
    do {
        float share = number > 0 ? left * share_of(frame.fields[number], p) : left;
        length_ += share * frame.fields[number].lower.w;
        left -= share;
    } while (--number >= 0);
    return length_;
}

float home_green(gpu_field field, cells_between cells)
{
    return texelFetch(field_lattice, texel_of(field, cells.home, 1), 0).x;
}

// The cells that tell the light before a surface: those half a cell off it. If something else stands there, such
// as the floor under a vase's belly, they know nothing of what is between; but nothing stands between the surface
// and the eye.
cells_between cells_before(gpu_field field, vec3 p, vec3 normal, vec3 view)
{
    float reach = 0.5 * field.lower.w;
    cells_between before = cells_around(field, p + normal * (reach * dot(abs(normal), vec3(1.0))));
    cells_between seen = cells_around(field, p + view * reach);
    ivec3 off = before.home - seen.home;
    bool parted = any(notEqual(off, ivec3(0))) && is_cut(seen.cuts, clamp(off, -1, 1));
    // Within what is solid it is dark; a cell on the way to the eye may be, too, if it is larger than that.
    return parted && home_green(field, seen) > home_green(field, before) ? seen : before;
}

// The light at a point of no surface (normal: 0), or as it is before one that is seen from a direction, of
// lattices up to that number.
field_light field_at(vec3 p, vec3 normal, vec3 view, int finest)
{
    field_light light = DARK;
    bool surface = normal != vec3(0.0), second = surface && frame.field.y != 0;
    vec4 plane = vec4(normal, surface ? dot(normal, p) : -1.0);
    float left = 1.0;
    int number = max(finest, 0);
    do {
        gpu_field field = frame.fields[number];
        float share = number > 0 ? left * share_of(field, p) : left;
        if (share <= 0.0)
            continue;
        cells_between cells = surface ? cells_before(field, p, normal, view) : cells_around(field, p);
        add_light(light, field_between(field, cells, plane, second), share);
        left -= share;
    } while (--number >= 0 && left > 0.0);
    return light;
}

// Radiance that a medium's point scatters towards a direction, per unit of sigma_s: bands 0 and 1
// of the light times those of the phase function.
vec3 field_scatter(vec3 p, vec3 out_direction, float g)
{
    if (!field_reaches(p))
        return vec3(0.0);
    field_light light = field_at(p, vec3(0.0), vec3(0.0), frame.field.x - 1);
    return max(light.fluence + 3.0 * g * (out_direction * light.flux), vec3(0.0)) / (4.0 * PI);
}

vec3 scattered_at(gpu_field field, vec3 at)
{
    at.z += float(field.dims.w);
    return textureLod(scattered_lattice, at / vec3(textureSize(scattered_lattice, 0)), 0.0).rgb;
}

// Whether surfaces part the cells that this interpolates between.
bool scattered_parted(gpu_field field, vec3 at)
{
    return texelFetch(scattered_lattice, texel_of(field, ivec3(at - 0.5), 0), 0).w > 0.0;
}

// The same as the cells of one of DOM's lattices scatter it, per unit of sigma_s, where nothing parts them.
// Beyond the outermost cells' centres it goes on as before them.
vec3 scattered_all_round(gpu_field field, vec3 at, vec3 last)
{
    vec3 light = scattered_at(field, last);
    vec3 before = scattered_at(field, clamp(2.0 * last - at, vec3(0.5), vec3(field.dims.xyz) - 0.5));
    return at == last ? light : clamp(2.0 * light - before, vec3(0.0), 2.0 * light);
}

// And of the cells on the point's side of surfaces, where some are parted.
vec3 scattered_beside(gpu_field field, vec3 p)
{
    cells_between cells = cells_around(field, p);
    vec4 sum = vec4(texelFetch(scattered_lattice, texel_of(field, cells.home, 0), 0).rgb, 1.0) * 1e-6;
    int corner = 0;
    do {
        ivec3 cell;
        float weight = share_of_cell(cells, field, corner, vec4(0.0, 0.0, 0.0, -1.0), cell);
        sum += weight * vec4(texelFetch(scattered_lattice, texel_of(field, cell, 0), 0).rgb, 1.0);
    } while (++corner < 8);
    return sum.rgb / sum.w;
}

// A loop, so that software need not do both: points that are asked one by one are mostly near surfaces.
vec3 scattered_in(gpu_field field, vec3 p)
{
    vec3 at = (p - field.lower.xyz) / field.lower.w;
    vec3 last = clamp(at, vec3(0.5), vec3(field.dims.xyz) - 0.5), light;
    bool parted = scattered_parted(field, last);
    int way = 0;
    do
        light = way == 0 ? scattered_beside(field, p) : scattered_all_round(field, at, last);
    while (++way < 2 && !parted);
    return light;
}

vec3 field_scattered(vec3 p)
{
    if (!field_reaches(p))
        return vec3(0.0);
    vec3 light = vec3(0.0);
    float left = 1.0;
    int number = max(frame.field.x - 1, 0);
    do {
        float share = number > 0 ? left * share_of(frame.fields[number], p) : left;
        if (share <= 0.0)
            continue;
        light += share * scattered_in(frame.fields[number], p);
        left -= share;
    } while (--number >= 0 && left > 0.0);
    return light;
}

// Where one look-up of the finest lattice's own interpolation tells all: well within it, far from surfaces.
bool field_scattered_open(gpu_field finest, vec3 p, out vec3 light)
{
    light = vec3(0.0);
    if (!field_reaches(p))
        return true;
    vec3 at = (p - finest.lower.xyz) / finest.lower.w;
    if (any(lessThan(at, vec3(0.5))) || any(greaterThan(at, vec3(finest.dims.xyz) - 0.5)) ||
        frame.field.x > 1 && share_of(finest, p) < 1.0)
        return false;
    light = scattered_at(finest, at);
    return !scattered_parted(finest, at);
}

// Band 2 of the radiance from, or to, a direction.
vec3 second_along(field_light light, vec3 d)
{
    return 1.0925484305920792 * (d.x * d.y * light.second[0] + d.y * d.z * light.second[1] + d.x * d.z * light.second[3]) +
           0.31539156525252005 * (3.0 * d.z * d.z - 1.0) * light.second[2] +
           0.5462742152960396 * (d.x * d.x - d.y * d.y) * light.second[4];
}

// Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001, eq. 13;
// of band 3 there is nothing in it.
vec3 field_irradiance(field_light light, vec3 normal)
{
    return max(0.25 * light.fluence - 0.5 * (normal * light.flux) + 0.25 * PI * second_along(light, normal),
               vec3(0.0));
}

// Radiance that arrives from a direction.
vec3 field_radiance(field_light light, vec3 towards)
{
    return max((light.fluence - 3.0 * (towards * light.flux)) / (4.0 * PI) + second_along(light, towards),
               vec3(0.0));
}
