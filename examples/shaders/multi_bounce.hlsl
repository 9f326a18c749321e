/* multi_bounce.hlsl - [J16] visibility that includes interreflection: a cubic of the visibility for each albedo.
 *
 *     in   result          visibility
 *     out  multi_bounce    of grey 0.5, then of `albedo` red, green, blue */
#include "gtao.hlsli"

StructuredBuffer<float> result : register(t0);
RWStructuredBuffer<float> multi_bounce : register(u10);

real gtao_multi_bounce(real visibility, real albedo) {
    real x = (real)clamp((float)visibility, 0.0, 1.0);
    real a = (real)2.0404 * albedo - (real)0.3324, b = (real)-4.7951 * albedo + (real)0.6417;
    real c = (real)2.7552 * albedo + (real)0.6903;
    real y = ((x * a + b) * x + c) * x;
#if MISTAKE == 20 /* the fit alone: darker than the visibility where the albedo is small */
    return y;
#else
    return (real)min(max((float)x, (float)y), 1.0); /* 1.0001 at visibility and albedo 1 */
#endif
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy;
    if (p.x >= full_width || p.y >= full_height)
        return;
    int i = at_image(p), plane = image_plane();
    real visibility = (real)result[i];
    multi_bounce[i] = (float)gtao_multi_bounce(visibility, (real)0.5);
    for (int k = 0; k < 3; k++)
        multi_bounce[i + (k + 1) * plane] = (float)gtao_multi_bounce(visibility, (real)albedo_rgb[k]);
}
