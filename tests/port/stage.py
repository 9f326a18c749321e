"""Horizons and integration of docs/porting.md in Python, from the other stages of a dump, compared with the dump's own.

    python3 tests/port/stage.py DUMP

Perspective or orthographic, cosine-weighted, normalized estimator, samples at steps, an open border."""
import math
import sys

sys.dont_write_bytecode = True
from dump import read_exr, read_settings


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def main(directory):
    s = read_settings(directory)
    width, height, planes = read_exr(directory + "/height.exr")
    w = planes["height"]
    surface = read_exr(directory + "/surface.exr")[2]
    noise = read_exr(directory + "/noise.exr")[2]
    steps, _, table = read_exr(directory + "/samples.exr")
    horizons = read_exr(directory + "/horizons.exr")[2]
    raw = read_exr(directory + "/raw.exr")[2]
    ortho, slices, classes = s["orthographic"], s["slices"], s["classes"]
    worst = {"horizons": 0.0, "visibility": 0.0, "weight": 0.0, "bent": 0.0}
    outside = 0

    for i in range(width * height):
        x, y = i % width, i // width
        radius_class, phase = int(surface["class"][i]), int(noise["phase"][i])
        if radius_class < 0:
            worst["visibility"] = max(worst["visibility"], abs(raw["visibility"][i] - 1))
            continue
        r = (0, 0, 1) if ortho else ((x + 0.5 - s["cx"]) * s["bx1"], (y + 0.5 - s["cy"]) * s["by1"], 1)
        length = math.sqrt(dot(r, r))
        v = [-a / length for a in r]
        n = [surface["normal." + c][i] for c in "XYZ"]
        gradient = (surface["gradient.X"][i], surface["gradient.Y"][i])
        unit = 1 if ortho else w[i]
        visible = whole = 0
        lost = [0, 0, 0]
        far_off = 0
        for k in range(slices):
            angle = math.pi * (k + noise["direction"][i]) / slices
            b = (math.cos(angle) * s["bx1"], math.sin(angle) * s["by1"], 0)
            bv = dot(b, v)
            o = [p - bv * q for p, q in zip(b, v)]
            perp = math.sqrt(dot(o, o))
            o = [p / perp for p in o]
            no, nv = dot(n, o), dot(n, v)
            jacobian, scale = 1 / perp**2, length / (unit * perp)
            h, occluded = [], False
            for side in (1, -1):
                tangent = -side * no / nv
                best = least = s["rise_min"] / scale
                c = c0 = tangent / math.sqrt(1 + tangent**2)
                row = ((phase * slices + k) * classes + radius_class) * steps
                for j in range(row, row + steps):
                    inv = table["inv_length"][j]
                    if inv == 0:
                        break
                    tx, ty = x + side * int(table["qx"][j]), y + side * int(table["qy"][j])
                    if not (0 <= tx < width and 0 <= ty < height) or w[ty * width + tx] <= s["sky_limit"]:
                        continue
                    sample = w[ty * width + tx]
                    u = (side * table["ux"][j], side * table["uy"][j])
                    rise = (sample - w[i]) * inv - dot(gradient, u)
                    kappa = rise * scale + tangent
                    rho = 1 + kappa**2
                    reach = s["reach"] * inv / perp * (1 if ortho else sample)
                    if not s["bounded"] or rho <= s["inner2"] * reach**2:
                        best = max(best, rise)
                    elif rho < reach**2 and rise > best and s["inv_falloff"] > 0:
                        weight = (1 - math.sqrt(rho) / reach) * s["inv_falloff"]
                        c = max(c, c0 + weight * (kappa / math.sqrt(rho) - c0))
                kappa = (best if best > least else 0.0) * scale + tangent
                if c > c0:
                    kappa = max(kappa, c / math.sqrt(1 - c**2))
                occluded = occluded or best > least or c > c0
                h.append(math.atan2(1, kappa))
                error = abs(h[-1] - horizons["%02d.%s" % (k, "plus" if side > 0 else "minus")][i])
                far_off = max(far_off, error)
            h1, h0, m, np = h[0], -h[1], math.atan2(no, nv), math.hypot(no, nv)
            opened = np * (math.cos(m) + m * math.sin(m))
            seen = opened
            if occluded:
                seen = sum(np * (math.cos(m) + 2 * a * math.sin(m) - math.cos(2 * a - m)) / 4 for a in (h0, h1))
                t_o = np * (6 * math.sin(h0 - m) - math.sin(3 * h0 - m) + 6 * math.sin(h1 - m) - math.sin(3 * h1 - m)
                            + 16 * math.sin(m) - 3 * (math.sin(h0 + m) + math.sin(h1 + m))) / 12
                t_v = np * (8 * math.cos(m) - math.cos(3 * h0 - m) - math.cos(3 * h1 - m)
                            - 3 * (math.cos(h0 + m) + math.cos(h1 + m))) / 12
                for q in range(3):
                    lost[q] += jacobian * ((4 / 3 * no - t_o) * o[q] + (2 / 3 * nv - t_v) * v[q])
            visible += jacobian * seen
            whole += jacobian * opened
        if far_off > 3e-4:
            outside += 1  # a sample on the very edge of the radius
            continue
        worst["horizons"] = max(worst["horizons"], far_off)
        worst["visibility"] = max(worst["visibility"], abs(visible / whole - raw["visibility"][i]))
        weight = min(max(s["weight_scale"] * whole / length, 1e-3), 1e3)
        worst["weight"] = max(worst["weight"], abs(weight - raw["weight"][i]))
        for q, name in enumerate(("bent.X", "bent.Y", "bent.Z")):
            worst["bent"] = max(worst["bent"], abs(2 / 3 * n[q] - lost[q] / whole - raw[name][i]))

    print("%d x %d, %d slices:" % (width, height, slices),
          ", ".join("%s %.1e" % item for item in worst.items()), "at most; %d pixels left out" % outside)
    return 0 if max(worst.values()) <= 3e-4 and outside <= 0.002 * width * height else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
