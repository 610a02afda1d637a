// SPDX-License-Identifier: GPL-3.0-or-later
// Reflection of a surface: Lambert or Burley, and GGX with Schlick's Fresnel.

struct surface
{
    vec3 normal;
    vec3 view;      // unit, towards the viewer
    vec3 diffuse;
    vec3 specular;  // F0
    float roughness;
    float burley;   // share of diffuse that is Burley's instead of Lambert's
};

// Schlick's approximation; cosine between view and half vector. Lambert surfaces have F0 = 0 and no
// coat: no rim either.
vec3 bsdf_fresnel(surface s, float cosine)
{
    float strongest = max(max(s.specular.r, s.specular.g), s.specular.b);
    float rim = pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0) * min(50.0 * strongest, 1.0);
    return s.specular + (1.0 - s.specular) * rim;
}

// Below this a highlight of a point light falls between the pixels.
float bsdf_alpha2(surface s)
{
    float alpha = max(s.roughness * s.roughness, 2e-3);
    return alpha * alpha;
}

// Walter et al., "Microfacet Models for Refraction", EGSR 2007, eq. 33.
float bsdf_distribution(float nh, float alpha2)
{
    float d = nh * nh * (alpha2 - 1.0) + 1.0;
    return alpha2 / (3.14159265358979 * d * d);
}

// Heitz, "Understanding the Masking-Shadowing Function", JCGT 2014, eq. 72, plus 1/2.
float bsdf_masking(float cosine, float alpha2)
{
    return 0.5 * sqrt(alpha2 / (cosine * cosine) + 1.0 - alpha2);
}

// Times the cosine; masking as Heitz, eq. 99.
vec3 bsdf_specular(surface s, vec3 light)
{
    float nl = dot(s.normal, light);
    float nv = max(dot(s.normal, s.view), 1e-4);
    if (nl <= 0.0 || s.specular == vec3(0.0))
        return vec3(0.0);
    float alpha2 = bsdf_alpha2(s);
    vec3 h = light + s.view;
    h *= inversesqrt(max(dot(h, h), 1e-12)); // a light exactly opposite the viewer has none
    float distribution = bsdf_distribution(clamp(dot(s.normal, h), 0.0, 1.0), alpha2);
    float masking = 1.0 / (bsdf_masking(nl, alpha2) + bsdf_masking(nv, alpha2));
    return bsdf_fresnel(s, dot(light, h)) * (distribution * masking / (4.0 * nv));
}

// A direction by lot from the specular lobe, what its light is multiplied by, and its density per
// solid angle. Black below the surface. Heitz, "Sampling the GGX Distribution of Visible Normals",
// JCGT 2018.
vec3 bsdf_sample(surface s, vec2 lot, out vec3 light, out float density)
{
    float alpha2 = bsdf_alpha2(s), alpha = sqrt(alpha2);
    vec3 t = across(s.normal);
    vec3 b = cross(s.normal, t);
    vec3 view = vec3(dot(s.view, t), dot(s.view, b), max(dot(s.view, s.normal), 1e-4));
    vec3 v = normalize(vec3(alpha * view.xy, view.z));
    vec3 t1 = dot(v.xy, v.xy) > 1e-12 ? normalize(vec3(-v.y, v.x, 0.0)) : vec3(1.0, 0.0, 0.0);
    vec3 t2 = cross(v, t1);
    float r = sqrt(lot.x), phi = 6.28318530717959 * lot.y;
    float x = r * cos(phi), share = 0.5 * (1.0 + v.z);
    float y = mix(sqrt(1.0 - x * x), r * sin(phi), share);
    vec3 m = x * t1 + y * t2 + sqrt(max(1.0 - x * x - y * y, 0.0)) * v;
    m = normalize(vec3(alpha * m.xy, max(m.z, 0.0)));
    vec3 h = m.x * t + m.y * b + m.z * s.normal;
    light = reflect(-s.view, h);
    float nl = dot(s.normal, light);
    float mask_v = bsdf_masking(view.z, alpha2);
    // Masking of the view alone is 1 / (1/2 + mask_v).
    density = bsdf_distribution(m.z, alpha2) / ((0.5 + mask_v) * 4.0 * view.z);
    if (nl <= 0.0)
        return vec3(0.0);
    return bsdf_fresnel(s, dot(s.view, h)) * ((0.5 + mask_v) /
                                              (mask_v + bsdf_masking(nl, alpha2)));
}

// Burley's factor over Lambert's: `retro` is twice the roughness times the squared cosine to the half vector,
// less 1/2 (Burley, "Physically-Based Shading at Disney", SIGGRAPH 2012 course, sec. 5.3).
float burley_factor(float retro, float rim_light, float rim_view)
{
    return (1.0 + retro * rim_light) * (1.0 + retro * rim_view);
}

float rim(float cosine)
{
    return pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0);
}

vec3 bsdf_diffuse(surface s, vec3 light)
{
    float nl = max(dot(s.normal, light), 0.0);
    float retro = s.roughness * (1.0 + dot(light, s.view)) - 0.5;
    float factor = mix(1.0, burley_factor(retro, rim(nl), rim(dot(s.normal, s.view))), s.burley);
    return s.diffuse * (factor * nl / 3.14159265358979);
}

// What is reflected of light that is alike from everywhere: the mean of the light's rim over its cosine is
// 1/21, of its cosine to the view 2/3 of the view's to the normal.
vec3 bsdf_diffuse_mean(surface s)
{
    float nv = clamp(dot(s.normal, s.view), 0.0, 1.0);
    float retro = s.roughness * (1.0 + nv * (2.0 / 3.0)) - 0.5;
    return s.diffuse * mix(1.0, burley_factor(retro, 1.0 / 21.0, rim(nv)), s.burley);
}
