/* pack.hlsl - results in 32 bits a pixel.
 *
 *     in   result
 *     out  packed        the four bytes of gtao_pack: visibility, bent x, y, z
 *          octahedral    visibility and bent normal through 10 + 11 + 11 bits and back, planes as result
 *          halves        the same through half floats: 64 bits a pixel */
#include "gtao.hlsli"

StructuredBuffer<float> result : register(t0);
RWStructuredBuffer<float> packed : register(u10);
RWStructuredBuffer<float> octahedral : register(u11);
RWStructuredBuffer<float> halves : register(u12);

/* x in [0, 1] to 0 .. scale, rounded. */
uint gtaoi_unorm(float x, float scale) {
#if MISTAKE == 23 /* cut off instead of rounded */
    return (uint)(clamp(x, 0.0, 1.0) * scale);
#else
    return (uint)(clamp(x, 0.0, 1.0) * scale + 0.5);
#endif
}

uint gtao_pack(float visibility, float3 b) {
    return gtaoi_unorm(visibility, 255.0) | gtaoi_unorm(0.5 + 0.5 * b.x, 255.0) << 8 |
           gtaoi_unorm(0.5 + 0.5 * b.y, 255.0) << 16 | gtaoi_unorm(0.5 + 0.5 * b.z, 255.0) << 24;
}

float sign_not_zero(float x) {
    return x < 0.0 ? -1.0 : 1.0;
}

/* The sphere onto an octahedron, whose lower half is folded out into the corners of a square: 11 bits an axis, within
 * 0.12 degrees. Towards the eye is z = -1, where most normals are: the half that is not folded. */
uint pack_octahedral(float visibility, float3 b) {
    float2 o = b.xy / (abs(b.x) + abs(b.y) + abs(b.z));
    if (b.z > 0.0)
        o = (1.0 - abs(o.yx)) * float2(sign_not_zero(o.x), sign_not_zero(o.y));
    return gtaoi_unorm(visibility, 1023.0) | gtaoi_unorm(0.5 + 0.5 * o.x, 2047.0) << 10 |
           gtaoi_unorm(0.5 + 0.5 * o.y, 2047.0) << 21;
}

float3 unpack_octahedral(uint bits, out float visibility) {
    float2 o = float2((float)(bits >> 10 & 2047u), (float)(bits >> 21)) * (2.0 / 2047.0) - 1.0;
    float3 b = float3(o, abs(o.x) + abs(o.y) - 1.0);
    visibility = (float)(bits & 1023u) * (1.0 / 1023.0);
    if (b.z > 0.0)
        b.xy = (1.0 - abs(o.yx)) * float2(sign_not_zero(o.x), sign_not_zero(o.y));
    return b * (1.0 / sqrt(dot(b, b)));
}

/* Four half floats in two words. */
uint2 pack_halves(float visibility, float3 b) {
    return uint2(f32tof16(visibility) | f32tof16(b.x) << 16, f32tof16(b.y) | f32tof16(b.z) << 16);
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy;
    if (p.x >= full_width || p.y >= full_height)
        return;
    int i = at_image(p), plane = image_plane(), k;
    float visibility = result[i], back;
    float3 b = float3(result[i + plane], result[i + 2 * plane], result[i + 3 * plane]);
    uint bytes = gtao_pack(visibility, b);
    uint2 words = pack_halves(visibility, b);
    float3 c = unpack_octahedral(pack_octahedral(visibility, b), back);
    octahedral[i] = back;
    for (k = 0; k < 4; k++) {
        packed[i + k * plane] = (float)(bytes >> 8 * k & 255u);
        halves[i + k * plane] = f16tof32(words[k >> 1] >> 16 * (k & 1) & 0xffffu);
        if (k < 3)
            octahedral[i + (k + 1) * plane] = c[k];
    }
}
