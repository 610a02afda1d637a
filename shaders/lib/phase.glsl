// SPDX-License-Identifier: GPL-3.0-or-later
// Phase functions, normalised to 1 over the sphere; cosine +1 is forward.

// Henyey and Greenstein, "Diffuse radiation in the galaxy", 1941, eq. 2.
float phase_hg(float cosine, float g)
{
    float denominator = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * 3.14159265358979 * denominator * sqrt(denominator));
}

// Of what is scattered, the share that counts as not scattered at all, where strong forward scattering is
// scaled away (Wiscombe, "The Delta-M Method", J. Atmos. Sci. 1977, eq. 14).
float forward_share(float g)
{
    return g * g * g * g;
}

// What bands 0 to 3 show of it without that, per unit of sigma_s. Lobes below 0 are no light.
float phase_soft(float cosine, float g)
{
    float f = forward_share(g), x2 = cosine * cosine;
    float bands = (1.0 - f) + 3.0 * (g - f) * cosine + 2.5 * (g * g - f) * (3.0 * x2 - 1.0) +
                  3.5 * (g * g * g - f) * cosine * (5.0 * x2 - 3.0);
    return max(bands, 0.0) / (4.0 * 3.14159265358979);
}

// The rest is the forward peak. Its moments are 1 up to the fourth, then g^(l - 4), per unit of f = g^4;
// scattered by it n times light has those to the power n, as of g^n. Where it has been scattered `times`
// times in the mean, it has been never, once, twice with the chances of Poisson: of all but never the g that
// has their mean fifth moment.
float peak_before(float g, float times)
{
    float never = exp(-times);
    float part = times > 1e-3 ? (exp(-times * (1.0 - g)) - never) / (1.0 - never) : g;
    float least = 0.2 / max(abs(g), 0.2); // with less 1 / part^4 is noise
    return part < 0.0 ? min(part, -least) : max(part, least);
}

// What the peak scatters of light that it has scattered `times` times before, of which `there` has not gone
// astray.
float phase_peak(float cosine, float g, float times, float there)
{
    float never = exp(-times);
    float before = peak_before(g, times), wide = g * before;
    return never * (phase_hg(cosine, g) - phase_soft(cosine, g)) +
           there * (1.0 - never) / forward_share(before) *
               (phase_hg(cosine, wide) - phase_soft(cosine, wide));
}

// The mean sine of the angle by which a peak turns light, its lobes below 0 counted as such: a fit of the
// integral over the sphere, within 3 % where g is 0.1 to 0.99 either way.
float peak_sine(float g)
{
    float rest = 1.0 - abs(g);
    return 0.466 * pow(rest, 0.61) / (1.0 + 1.56 * rest);
}
