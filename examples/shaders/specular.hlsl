/* specular.hlsl - specular visibility [J16] from visibility, bent normal, normal, view vector and roughness by a table
 * that gtso_bake made: gtso.h's default, the full BRDF with n = b over aperture (an angle), beta (stored by its
 * distance from the cone's edge) and roughness.
 *
 *     in   result, surface (image resolution), specular_table (aperture fastest, then beta, then roughness)
 *     out  specular    plane `specular_plane`
 *
 * On a console the table is a 3D texture, and trilinear filtering does what table_at does: texel i of N stands for
 * u = i / (N - 1), so sample at u (N - 1) / N + 1 / (2 N). Filters with 8 bits of fraction cost 0.0005. */
#include "gtao.hlsli"

StructuredBuffer<float> result : register(t0);
StructuredBuffer<float> surface : register(t1);
StructuredBuffer<float> specular_table : register(t2);
RWStructuredBuffer<float> specular : register(u10);

float table_at(float3 u) {
    int3 size = int3(table_aperture, table_beta, table_roughness);
    float3 at = clamp(u, 0.0, 1.0) * (float3)(size - 1), whole = min(floor(at), (float3)(size - 2));
    float3 fraction = at - whole;
    int3 q = (int3)whole;
    float value[2];
    for (int k = 0; k < 2; k++) {
        int i = ((q.z + k) * size.y + q.y) * size.x + q.x;
        float low = lerp(specular_table[i], specular_table[i + 1], fraction.x);
        float high = lerp(specular_table[i + size.x], specular_table[i + size.x + 1], fraction.x);
        value[k] = lerp(low, high, fraction.y);
    }
    return lerp(value[0], value[1], fraction.z);
}

/* 2 sin(a / 2) from cos a. */
float gtsoi_chord(float cosine) {
    return sqrt(2.0 * (1.0 - cosine));
}

float gtso_lookup(float visibility, float3 b, float3 n, float3 v) {
    float nv = clamp(dot(n, v), 0.0, 1.0), nb = clamp(dot(n, b), -1.0, 1.0), bv = clamp(dot(b, v), -1.0, 1.0);
    float share = clamp(visibility, 0.0, 1.0);
#if MISTAKE != 22 /* the aperture of a cone about the normal for one about the bent normal */
    if (weighting == WEIGHTING_COSINE)
        share = min(share / max(nb, 1e-6), 1.0);
#endif
    float cos_aperture = weighting == WEIGHTING_COSINE ? sqrt(1.0 - share) : 1.0 - share;
    float cos_beta = clamp(2.0 * nv * nb - bv, -1.0, 1.0); /* R.b */
    float aperture = gtsoi_chord(cos_aperture), beta = gtsoi_chord(cos_beta);
    float3 u;
    u.x = cos_aperture <= 0.0 ? 1.0 : gtao_acos(cos_aperture) * (2.0 / PI);
    /* GTSO_SCALE_EDGE: g = e / (w + |e|) of e = chord(aperture) - chord(beta), w = 2 alpha, from that of the largest
     * beta to that of 0 */
    float w = 2.0 * max(roughness * roughness, 1e-4), rest = 2.0 - aperture, e = aperture - beta;
    float low = w + rest, high = w + aperture, middle = w + abs(e);
    u.y = (e * low + rest * middle) * high / ((aperture * low + rest * high) * middle);
    u.z = roughness;
    return clamp(table_at(u), 0.0, 1.0);
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy;
    if (p.x >= full_width || p.y >= full_height)
        return;
    int i = at_image(p), plane = image_plane();
    float2 r = ray((float2)p, full_bx1, full_by1, full_cx, full_cy);
    float3 v = float3(r, 1.0) * (-1.0 / sqrt(dot(r, r) + 1.0));
    float3 b = float3(result[i + plane], result[i + 2 * plane], result[i + 3 * plane]), n = b;
    if (0.0 <= surface[i + 6 * plane])
        n = float3(surface[i], surface[i + plane], surface[i + 2 * plane]);
#if HALF
    b = float3((real3)b);
    n = float3((real3)n);
#endif
    specular[i + specular_plane * plane] = (float)(real)gtso_lookup((float)(real)result[i], b, n, v);
}
