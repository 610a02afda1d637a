// SPDX-License-Identifier: GPL-3.0-or-later
// Reflection of a surface: Lambert, and GGX with Schlick's Fresnel.

struct surface
{
    vec3 normal;
    vec3 view;      // unit, towards the viewer
    vec3 diffuse;
    vec3 specular;  // F0
    float roughness;
};

// Walter et al., "Microfacet Models for Refraction", EGSR 2007, eq. 33 and 34; Heitz, JCGT 2014,
// eq. 99 for the joint masking. Times the cosine.
vec3 bsdf_specular(surface s, vec3 light)
{
    float nl = dot(s.normal, light);
    float nv = max(dot(s.normal, s.view), 1e-4);
    if (nl <= 0.0 || s.specular == vec3(0.0))
        return vec3(0.0);
    // Below this a highlight of a point light falls between the pixels.
    float alpha = max(s.roughness * s.roughness, 2e-3);
    float alpha2 = alpha * alpha;
    vec3 h = light + s.view;
    h *= inversesqrt(max(dot(h, h), 1e-12)); // a light exactly opposite the viewer has none
    float nh = clamp(dot(s.normal, h), 0.0, 1.0);
    float d = nh * nh * (alpha2 - 1.0) + 1.0;
    float distribution = alpha2 / (3.14159265358979 * d * d);
    float masking = 0.5 / (nl * sqrt(alpha2 + (1.0 - alpha2) * nv * nv) +
                           nv * sqrt(alpha2 + (1.0 - alpha2) * nl * nl));
    float schlick = pow(1.0 - clamp(dot(light, h), 0.0, 1.0), 5.0);
    // Lambert surfaces have F0 = 0 and no coat: no Fresnel rim either.
    vec3 fresnel = s.specular + (1.0 - s.specular) * schlick * min(50.0 * max(max(s.specular.r, s.specular.g), s.specular.b), 1.0);
    return fresnel * (distribution * masking * nl);
}

vec3 bsdf_diffuse(surface s, vec3 light)
{
    return s.diffuse * (max(dot(s.normal, light), 0.0) / 3.14159265358979);
}

// Split-sum factor for light from all around a mirror direction: Karis, "Physically Based Shading
// on Mobile", 2014 (fit by Lazarov).
vec3 bsdf_environment(surface s)
{
    vec4 r = s.roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float nv = clamp(dot(s.normal, s.view), 0.0, 1.0);
    float a = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    vec2 ab = vec2(-1.04, 1.04) * a + r.zw;
    return s.specular * ab.x + vec3(ab.y) * min(50.0 * max(max(s.specular.r, s.specular.g), s.specular.b), 1.0);
}
