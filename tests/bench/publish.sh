#!/bin/sh
# publish.sh [docs]: figures and tables from build/bench/*.csv into build/bench/; with `docs` also into docs/, the tables
# between the lines <!-- begin: NAME --> and <!-- end: NAME --> of its pages.
set -eu
export LC_ALL=C.UTF-8
out=build/bench/tables
mkdir -p $out
error=build/bench/error.csv speed=build/bench/speed.csv truth=build/bench/truth.csv host=build/bench/host.csv

for name in cost pareto samples scenes thickness; do
    gnuplot "tests/bench/$name.gp" > "build/bench/bench_$name.svg"
done

# ---- tables ---------------------------------------------------------------------------------------------------------

awk -F, 'NR == 2 {
    printf "Measured on %s: %s, %d processors (a virtual machine shared with other work), compiled by %s. `auto` is the %s kernel here.\n", $6, $1, $2, "gcc " $5, $4
    if ($7 == "quick") print "\n*From a quick run: small images, few repetitions.*"
}' $host > $out/host.md

awk -F, '$1 == "isa" {
    if (!($2 in seen)) { seen[$2] = ++n; scene[n] = $2; reach[n] = $4 }
    ns[$2, $3] = $5; ratio[$2, $3] = $7
    if (n == 1) kernel[++k] = $3
} END {
    printf "| scene | mean radius |"; for (i = 1; i <= k; i++) printf " %s |", kernel[i]; print ""
    printf "|---|--:|"; for (i = 1; i <= k; i++) printf "--:|"; print ""
    for (s = 1; s <= n; s++) {
        printf "| %s | %.0f px |", scene[s], reach[s]
        for (i = 1; i <= k; i++) printf (i == 1 ? " %.0f ns |" : " %.1f ns (%.1f) |"), ns[scene[s], kernel[i]], ratio[scene[s], kernel[i]]
        print ""
    }
}' $speed > $out/isa.md

# Means over the scenes for the front page.
awk -F, -v isa="$(awk -F, 'NR == 2 { print $4 }' $host)" '
    $1 == "isa" { if (!($3 in n)) kernel[++k] = $3; n[$3]++; ns[$3] += $5; ratio[$3] += $7 }
    $1 == "resolution" { ms[$4] = $5 * $4 * $4 * 9 / 16e6 }
    $1 == "threads" && $4 == 2 { two[$3] = $7 }
    END {
        print "| kernel | ns per pixel | times faster than the transcription |\n|---|--:|--:|"
        for (i = 1; i <= k; i++) printf "| %s | %.1f | %.1f |\n", kernel[i] == "transcription" ? "scalar transcription of the memo, -O3 -march=native" : kernel[i], ns[kernel[i]] / n[kernel[i]], ratio[kernel[i]] / n[kernel[i]]
        printf "\n960x540 takes %.1f ms, 1920x1080 %.1f ms (%s, one thread).\n", ms[960], ms[1920], isa
    }' $speed > $out/readme-speed.md

awk -F, 'BEGIN { print "| scene | samples | ns per sample | load and maximum | ratio |\n|---|---|--:|--:|--:|" }
    $1 == "marginal" { what = $3; sub(/;/, ",", what); m = $5; r = $7; s = $2 }
    $1 == "floor" { printf "| %s | %s | %.3f | %.3f | %.1f |\n", s, what, m, $5, r }' $speed > $out/marginal.md

awk -F, '$1 == "nearness" {
    if (!($2 in seen)) { seen[$2] = 1; scene[++n] = $2 }
    if (n == 1) { scale[++k] = $4 }
    ns[$2, $4] = $5
} END {
    printf "| depth times |"; for (i = 1; i <= k; i++) printf " 1/%d |", 1 / scale[i]; print ""
    printf "|---|"; for (i = 1; i <= k; i++) printf "--:|"; print ""
    for (s = 1; s <= n; s++) {
        printf "| %s, ns per pixel |", scene[s]
        for (i = 1; i <= k; i++) printf " %.1f |", ns[scene[s], scale[i]]
        print ""
    }
}' $speed > $out/nearness.md

awk -F, 'BEGIN { print "| image | ns per pixel | ms | times 960x540 | with the cap growing: ns per pixel | times 960x540 |\n|---|--:|--:|--:|--:|--:|" }
    $1 == "resolution" { w[++n] = $4; ns[n] = $5; r[n] = $7 }
    $1 == "resolution_scaled_cap" { ns2[++m] = $5; r2[m] = $7 }
    END { for (i = 1; i <= n; i++) printf "| %dx%d | %.1f | %.2f | %.2f | %.1f | %.2f |\n", w[i], w[i] * 9 / 16, ns[i], ns[i] * w[i] * w[i] * 9 / 16e6, r[i], ns2[i], r2[i] }' $speed > $out/resolution.md

awk -F, 'BEGIN { print "| work | threads | ns per pixel | times as fast as one |\n|---|--:|--:|--:|" }
    $1 == "threads" { printf "| %s | %d | %.1f | %.2f |\n", $3, $4, $5, $7 }' $speed > $out/threads.md

awk -F, '$1 == "variant" {
    if (!($2 in seen)) { seen[$2] = 1; scene[++n] = $2 }
    if (n == 1) what[++k] = $3
    ns[$2, $3] = $5; sum[$3] += $7; count[$3]++
} END {
    printf "| |"; for (s = 1; s <= n; s++) printf " %s |", scene[s]; print " ratio |"
    printf "|---|"; for (s = 1; s <= n; s++) printf "--:|"; print "--:|"
    for (i = 1; i <= k; i++) {
        label = what[i]; sub(/;/, ",", label)
        printf "| %s |", label
        for (s = 1; s <= n; s++) printf " %.1f |", ns[scene[s], what[i]]
        printf " %.2f |\n", sum[what[i]] / count[what[i]]
    }
}' $speed > $out/variants.md

awk -F, 'BEGIN { print "| setting, 960x540 | bytes per pixel |\n|---|--:|" }
    $1 == "scratch" { printf "| %s | %.1f |\n", $3, $5 }' $speed > $out/scratch.md

# Noise of the truths, pooled in the row "pooled".
awk -F, 'BEGIN { print "| scene | directions a pixel | noise, depth buffer | noise, ray tracing | sky | mean radius |\n|---|--:|--:|--:|--:|--:|" }
    NR > 1 { printf "| %s | %d | %.4f | %.4f | %.0f %% | %.0f px |\n", $1, $2, $3, $4, 100 * $6, $7 }' $truth > $out/truth.md

# awk programs below first read truth.csv, then error.csv
less='function less(rmse, n) { return sqrt(rmse * rmse > n * n ? rmse * rmse - n * n : 0) }
    FILENAME ~ /truth/ { if (FNR > 1) { noise[$1] = $3; rays_noise[$1] = $4; v += $3 * $3; r += $4 * $4; scenes++; name[scenes] = $1 } next }
    FNR == 1 { noise["pooled"] = sqrt(v / scenes); rays_noise["pooled"] = sqrt(r / scenes) }'

awk -F, "$less"' $1 == "pooled" && $2 == "gtao preset" && $9 == "plain" {
        if ($8 == "view") { p[++n] = $3; sl[n] = $4; st[n] = $5; ns[n] = $7; e[n] = $10; m[n] = $11; psnr[n] = $12; ssim[n] = $13; most[n] = $14 }
        else ray[$3] = $10
    }
    $1 == "pooled" && $2 == "gtao scalar" { scalar[$3] = $7 }
    END {
        print "| preset | slices x samples a side | ns per pixel | RMSE | mean error | SSIM | largest | RMSE to ray tracing |"
        print "|---|---|--:|--:|--:|--:|--:|--:|"
        for (i = 1; i <= n; i++)
            printf "| %s | %d x %s | %.0f | %.4f | %+.4f | %.3f | %.2f | %.3f |\n", p[i], sl[i], st[i] ? st[i] : "every pixel", ns[i], less(e[i], noise["pooled"]), m[i], ssim[i], most[i], ray[p[i]]
    }' $truth $error > $out/presets.md

awk -F, "$less"' $1 != "pooled" && $2 == "gtao preset" && $9 == "plain" && $8 == "view" {
        e[$1, $3] = less($10, noise[$1]); if (!($3 in seen)) { seen[$3] = 1; p[++n] = $3 }
    }
    $1 != "pooled" && $2 == "gtao preset" && $9 == "plain" && $8 == "rays" { ray[$1, $3] = $10 }
    $2 == "depth buffer" { gap[$1] = $10; bias[$1] = $11 }
    END {
        printf "| scene |"; for (i = 1; i <= n; i++) printf " %s |", p[i]; print " depth buffer to ray tracing | mean | reference to ray tracing |"
        printf "|---|"; for (i = 1; i <= n; i++) printf "--:|"; print "--:|--:|--:|"
        for (s = 1; s <= scenes; s++) {
            printf "| %s |", name[s]
            for (i = 1; i <= n; i++) printf " %.4f |", e[name[s], p[i]]
            printf " %.3f | %+.3f | %.3f |\n", gap[name[s]], bias[name[s]], ray[name[s], "reference"]
        }
    }' $truth $error > $out/presets_scenes.md

# Where a preset's error comes from: its samples with 64 slices, its slices with every pixel.
awk -F, "$less"' $1 == "pooled" && $8 == "view" && $9 == "plain" {
        if ($2 == "gtao") { e[$3] = less($10, noise["pooled"]); m[$3] = $11 }
        if ($2 == "gtao preset") { p[++n] = $3; sl[n] = $4; st[n] = $5; all[n] = less($10, noise["pooled"]); bias[n] = $11 }
    }
    END {
        print "| preset | RMSE | of its samples (64 slices of them) | of its slices (every pixel on them) | mean error | of its samples | of its slices |\n|---|--:|--:|--:|--:|--:|--:|"
        for (i = 1; i <= n; i++) {
            a = "64x" (st[i] ? st[i] : "all"); b = sl[i] "xall"
            printf "| %s | %.4f | %s | %s | %+.4f | %s | %s |\n", p[i], all[i], a in e ? sprintf("%.4f", e[a]) : "", b in e ? sprintf("%.4f", e[b]) : "", bias[i], a in m ? sprintf("%+.4f", m[a]) : "", b in m ? sprintf("%+.4f", m[b]) : ""
        }
    }' $truth $error > $out/sources.md

# What changes with other settings, every pixel on 32 slices.
awk -F, "$less"' $9 == "plain" && $8 == "view" && $3 == "32xall" {
        label = $2; if (label == "gtao") label = "as the truth: hard cutoff, no cap"
        sub(/^gtao /, "", label)
        if (label == "as the truth: hard cutoff, no cap" || label ~ /falloff|capped|derived/) {
            if (!(label in seen)) { seen[label] = 1; l[++n] = label }
            e[label, $1] = less($10, noise[$1]); m[label, $1] = $11
        }
    }
    END {
        printf "| scene |"; for (i = 1; i <= n; i++) printf " %s |", l[i]; print ""
        printf "|---|"; for (i = 1; i <= n; i++) printf "--:|"; print ""
        name[++scenes] = "pooled"
        for (s = 1; s <= scenes; s++) {
            printf "| %s |", name[s]
            for (i = 1; i <= n; i++) printf " %.4f (%+.4f) |", e[l[i], name[s]], m[l[i], name[s]]
            print ""
        }
    }' $truth $error > $out/settings.md

# The front itself.
awk -F, "$less"' $1 == "pooled" && $2 == "gtao" && $8 == "view" && $9 == "plain" { print $7, $10, less($10, noise["pooled"]), $11, $13, $3 }' $truth $error | sort -g |
    awk 'BEGIN { print "| setting | ns per pixel | RMSE | without noise | mean | SSIM |\n|---|--:|--:|--:|--:|--:|" }
        NR == 1 || $2 < least { least = $2; printf "| %s | %.1f | %.4f | %.4f | %+.4f | %.3f |\n", $6, $1, $2, $3, $4, $5 }' > $out/front.md

awk -F, '$1 == "pooled" && $8 == "view" && $9 == "plain" && $2 ~ /^gtao power/ {
        split($2, part, " "); if (!($3 in seen)) { seen[$3] = 1; s[++n] = $3 }
        e[$3, part[3]] = $10; sum[part[3]] += $10 * $10; if (!(part[3] in have)) { have[part[3]] = 1; p[++k] = part[3] }
    }
    END {
        printf "| slices x samples |"; for (i = 1; i <= k; i++) printf " power %s |", p[i]; print ""
        printf "|---|"; for (i = 1; i <= k; i++) printf "--:|"; print ""
        for (j = 1; j <= n; j++) { printf "| %s |", s[j]; for (i = 1; i <= k; i++) printf " %.4f |", e[s[j], p[i]]; print "" }
        printf "| all |"; for (i = 1; i <= k; i++) printf " %.4f |", sqrt(sum[p[i]] / n); print ""
    }' $error > $out/power.md

# Every method, all scenes; beside it what the library reaches in the same time.
awk -F, '$1 == "pooled" {
        if ($2 == "gtao" && $9 == "plain" && $8 == "view") { n++; t[n] = $7; e[n] = $10; set[n] = $3 }
        if ($2 == "gtao" && $9 == "fitted" && $8 == "rays") r[$3] = $10
        if ($2 !~ /^gtao( |$)/ || $2 == "gtao-memo") {
            key = $2 " " $3; if (!(key in seen)) { seen[key] = 1; k[++m] = key }
            ns[key] = $7; x[key, $8, $9] = $10; ssim[key, $8, $9] = $13
        }
    }
    END {
        print "| method | ns per pixel | RMSE to the depth buffer: published | fitted | gtao.h in that time | with | RMSE to ray tracing: published | fitted | gtao.h fitted, that setting |"
        print "|---|--:|--:|--:|--:|---|--:|--:|--:|"
        for (j = 1; j <= m; j++) {
            best = 9; with = "none"
            for (i = 1; i <= n; i++) if (t[i] <= ns[k[j]] && e[i] < best) { best = e[i]; with = set[i] }
            printf "| %s | %.0f | %.3f | %.3f | %s | %s | %.3f | %.3f | %s |\n", k[j], ns[k[j]], x[k[j], "view", "plain"], x[k[j], "view", "fitted"], best < 9 ? sprintf("%.3f", best) : "", with, x[k[j], "rays", "plain"], x[k[j], "rays", "fitted"], best < 9 ? sprintf("%.3f", r[with]) : ""
        }
    }' $error > $out/rivals.md

# Settings of screen-space rivals that have less error than the library in the same time, per scene and truth.
awk -F, '$1 != "pooled" && $2 != "depth buffer" {
        if ($2 == "gtao" && $9 == ($8 == "view" ? "plain" : "fitted")) { n[$1, $8]++; t[$1, $8, n[$1, $8]] = $7; e[$1, $8, n[$1, $8]] = $10; set[$1, $8, n[$1, $8]] = $3 }
        else if ($2 == "gtao scalar" && $9 == ($8 == "view" ? "plain" : "fitted")) { q[$1, $8]++; qt[$1, $8, q[$1, $8]] = $7; qe[$1, $8, q[$1, $8]] = $10 }
        else if (($2 == "gtao-memo" || $2 !~ /^gtao/) && $2 !~ /rays|voxel/ && $9 == "fitted") { row[++rows] = $0 }
        if (!($1 in seen)) { seen[$1] = 1; scene[++scenes] = $1 }
    }
    END {
        for (j = 1; j <= rows; j++) {
            split(row[j], f, ","); s = f[1] SUBSEP f[8]; best = 9; slow = 9; with = ""
            for (i = 1; i <= n[s]; i++) if (t[s, i] <= f[7] && e[s, i] < best) { best = e[s, i]; with = set[s, i] }
            for (i = 1; i <= q[s]; i++) if (qt[s, i] <= f[7] && qe[s, i] < slow) slow = qe[s, i]
            all[f[8]]++
            if (f[10] < best) { lost[f[8]]++; line[++lines] = sprintf("| %s | %s | %s %s | %.0f | %.4f | %s | %s |", f[8] == "view" ? "depth buffer" : "ray tracing", f[1], f[2], f[3], f[7], f[10], best < 9 ? sprintf("%.4f", best) : "none as fast", with) }
            if (f[10] < slow) { lost_scalar[f[8]]++; none[f[8]] += slow == 9 }
        }
        printf "Of %d pairs of a rival'"'"'s setting and a scene, the rival has less error than the library in the same time in %d against the truth of the depth buffer, and in %d of %d against ray tracing (both fitted). With the library'"'"'s scalar kernel, settings 1x4 to 16x32: %d and %d, of which %d and %d in times for which that kernel has no setting at all.\n", all["view"], lost["view"], lost["rays"], all["rays"], lost_scalar["view"], lost_scalar["rays"], none["view"], none["rays"]
        if (lines) print "\n| truth | scene | rival | ns per pixel | its RMSE, fitted | gtao.h in that time | with |\n|---|---|---|--:|--:|--:|---|"
        for (i = 1; i <= lines; i++) print line[i]
    }' $error > $out/exceptions.md

# The two estimators at the same settings.
awk -F, '$8 == "view" && $9 == "plain" && ($2 == "gtao" || $2 == "gtao memo estimator") {
        e[$2, $3, $1] = $10; ns[$2, $3, $1] = $7; ssim[$2, $3, $1] = $13
        if ($2 != "gtao") { if (!($3 in seen)) { seen[$3] = 1; s[++n] = $3 } if ($1 != "pooled" && !($1 in known)) { known[$1] = 1; scene[++scenes] = $1 } }
    }
    END {
        print "| setting | normalized: RMSE | SSIM | ns | memo: RMSE | SSIM | ns | scenes on which normalized has less error |\n|---|--:|--:|--:|--:|--:|--:|--:|"
        for (i = 1; i <= n; i++) {
            won = 0; for (j = 1; j <= scenes; j++) won += e["gtao", s[i], scene[j]] < e["gtao memo estimator", s[i], scene[j]]
            printf "| %s | %.4f | %.3f | %.1f | %.4f | %.3f | %.1f | %d of %d |\n", s[i], e["gtao", s[i], "pooled"], ssim["gtao", s[i], "pooled"], ns["gtao", s[i], "pooled"], e["gtao memo estimator", s[i], "pooled"], ssim["gtao memo estimator", s[i], "pooled"], ns["gtao memo estimator", s[i], "pooled"], won, scenes
        }
    }' $error > $out/estimators.md

# Embree: equal RMSE to the depth buffer's truth, which rays through the scene do not converge to; equal sampling error,
# each against its own truth; and the rays that reach the library's error against ray tracing.
awk -F, "$less"' $1 != "pooled" && $9 == "plain" {
        if ($2 == "gtao" && $8 == "view") { n[$1]++; t[$1, n[$1]] = $7; e[$1, n[$1]] = $10; own[$1, n[$1]] = less($10, noise[$1]); set[$1, n[$1]] = $3 }
        if ($2 == "rays") { ns[$1, $3] = $7; if ($8 == "view") x[$1, $3] = $10; else { y[$1, $3] = $10; own_ray[$1, $3] = less($10, rays_noise[$1]) } }
        if ($2 == "gtao preset" && $8 == "rays" && $3 == "high") { high[$1] = $10; high_ns[$1] = $7 }
    }
    function note(i, x) { if (!(i in lo) || x < lo[i]) lo[i] = x; if (!(i in hi) || x > hi[i]) hi[i] = x }
    END {
        print "| scene | Embree, 16 rays: ns per pixel | RMSE to the depth buffer | gtao.h no worse: ns (setting) | factor | RMSE to its own truth | gtao.h no worse to its own: ns (setting) | factor | RMSE of high to ray tracing | rays that reach it: ns | factor |"
        print "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
        for (s = 1; s <= scenes; s++) {
            k = name[s]; a = b = 1e9; as = bs = "none"
            for (i = 1; i <= n[k]; i++) {
                if (e[k, i] <= x[k, 16] && t[k, i] < a) { a = t[k, i]; as = set[k, i] }
                if (own[k, i] <= own_ray[k, 16] && t[k, i] < b) { b = t[k, i]; bs = set[k, i] }
            }
            # error against time of the rays is a line in logarithms between their counts
            c = ""
            for (q = 1; q < 256 && (k SUBSEP 4 * q) in y; q *= 4)
                if (y[k, q] >= high[k] && y[k, 4 * q] <= high[k])
                    c = exp(log(ns[k, q]) + (log(ns[k, 4 * q]) - log(ns[k, q])) * (log(y[k, q]) - log(high[k])) / (log(y[k, q]) - log(y[k, 4 * q])))
            if (c == "" && y[k, 1] < high[k]) c = ns[k, 1]
            printf "| %s | %.0f | %.3f | %.1f (%s) | %.0f | %.3f | %.1f (%s) | %.0f | %.3f | %.0f | %.0f |\n", k, ns[k, 16], x[k, 16], a, as, ns[k, 16] / a, own_ray[k, 16], b, bs, ns[k, 16] / b, high[k], c, c / high_ns[k]
            note(1, ns[k, 16] / a); note(2, ns[k, 16] / b); note(3, c / high_ns[k])
        }
        printf "\nFactors in time: %.0f to %.0f at equal RMSE to the depth buffer, %.0f to %.0f at equal noise, %.0f to %.0f at equal RMSE to ray tracing.\n", lo[1], hi[1], lo[2], hi[2], lo[3], hi[3]
    }' $truth $error > $out/embree.md

# Irradiance: root mean squares over the probes, scene by scene; and probe by probe, over the scenes.
for source in rays thick depth; do
    awk -F, -v source=$source 'NR > 1 && $2 == source {
            if (!(($1) in seen)) { seen[$1] = 1; s[++n] = $1 }
            if (n == 1 && !($3 in known)) { known[$3] = 1; m[++k] = $3 }
            e[$1, $3] += $5 * $5; count[$1, $3]++; all[$3] += $5 * $5; times[$3]++
            if (n == 1 && !($4 in lit)) { lit[$4] = 1; p[++q] = $4 }
            by[$4, $3] += $5 * $5; number[$4, $3]++; mean[$3] += $6
        }
        END {
            printf "| scene |"; for (j = 1; j <= k; j++) printf " %s |", m[j]; print ""
            printf "|---|"; for (j = 1; j <= k; j++) printf "--:|"; print ""
            for (i = 1; i <= n; i++) { printf "| %s |", s[i]; for (j = 1; j <= k; j++) printf " %.3f |", sqrt(e[s[i], m[j]] / count[s[i], m[j]]); print "" }
            for (i = 1; i <= q; i++) { printf "| all, %s |", p[i]; for (j = 1; j <= k; j++) printf " %.3f |", sqrt(by[p[i], m[j]] / number[p[i], m[j]]); print "" }
            printf "| all |"; for (j = 1; j <= k; j++) printf " **%.3f** |", sqrt(all[m[j]] / times[m[j]]); print ""
            printf "| mean error |"; for (j = 1; j <= k; j++) printf " %+.3f |", mean[m[j]] / times[m[j]]; print "\n"
            printf "Scenes on which the horizons have less error:"
            for (j = 1; j < k; j++) {
                won = 0; for (i = 1; i <= n; i++) won += e[s[i], m[k]] < e[s[i], m[j]]
                printf " than %s %d of %d%s", m[j], won, n, j < k - 1 ? "," : ".\n"
            }
        }' build/bench/directional.csv > $out/directional-$source.md
done

awk -F, '$2 == "cost" { if ($4 == "ns") { v += $5; b += $6; n++ } else sh += $5 }
    END { printf "Visibility %.1f ns a pixel, with bent normals %.1f, with nine coefficients %.1f (2 slices of 12 samples, mean of the scenes, one thread).\n", v / n, b / n, sh / n }' build/bench/directional.csv > $out/directional-cost.md

# ---- occluders with thickness ----------------------------------------------------------------------------------------

thick=build/bench/thickness.csv

# Pooled errors of every method. Older methods: as published, and through an output function fitted to that truth.
awk -F, 'NR > 1 && $1 == "pooled" {
        key = $2 "," $3; if ($5 == "best") key = key ",best"
        if (!(key in seen)) { seen[key] = 1; k[++n] = key }
        e[key, $4, $5] = $6; m[key, $4, $5] = $7; out[key] = out[key] " " $5
    }
    function cell(key, truth, output) { return (key, truth, output) in e ? sprintf("%.4f (%+.4f)", e[key, truth, output], m[key, truth, output]) : "" }
    END {
        hf = e["height field,", "rays", "plain"]; hv = e["height field,", "inside", "plain"]
        print "| method | RMSE to ray tracing (mean) | to the height field'"'"'s | inside the view: RMSE (mean) |"
        print "|---|--:|--:|--:|"
        split("height field,;slides'"'"' blend;constant;screen width,;estimate,;back faces,1;mask and minimum,2;layers,2;layers,4;layers,8;fronts only,4;estimate for the first,4;rays inside the view,;prototype,4", order, ";")
        for (i = 1; i <= 20; i++) for (j = 1; j <= n; j++) {
            key = k[j]; split(key, f, ","); o = out[key] ~ /best/ ? "best" : "plain"
            if (order[i] == "" || !(key == order[i] || (o == "best" && f[1] == order[i]))) continue
            label = f[1] (f[2] ? ", " f[2] : "")
            sub(/, 1$/, "", label); sub(/^layers, ([248])$/, "& two-sided layers", label); sub(/^layers, /, "", label)
            sub(/^mask and minimum, 2/, "two results by mask and minimum [TP16]", label); sub(/^fronts only, 4/, "4 layers, fronts only", label)
            sub(/^estimate for the first, 4/, "4 layers, the first with estimated backs", label); sub(/^slides. blend/, "blend of [J16]", label); sub(/^prototype, 4/, "4 two-sided layers, prototype", label)
            sub(/^constant/, "constant, parts of the radius", label); sub(/^screen width/, "as thick as wide on the screen", label)
            printf "| %s | %s | %.2f | %s |\n", label, cell(key, "rays", o), e[key, "rays", o] / hf, cell(key, "inside", o)
        }
    }' $thick > $out/thickness.md

awk -F, 'NR > 1 && $1 == "pooled" {
        key = $2 " " $3; e[key, $4, $5] = $6
        if ($5 == "fitted" && !(key in seen)) { seen[key] = 1; k[++n] = key }
        if ($5 == "plain" && $2 == "rays" && !(key in seen)) { seen[key] = 1; k[++n] = key }
        if ($5 == "plain" && $2 == "rays") e[key, $4, "fitted"] = $6
    }
    END {
        print "| rival | RMSE to ray tracing: published | fitted | inside the view: published | fitted |\n|---|--:|--:|--:|--:|"
        for (j = 1; j <= n; j++)
            printf "| %s | %.4f | %.4f | %.4f | %.4f |\n", k[j], e[k[j], "rays", "plain"], e[k[j], "rays", "fitted"], e[k[j], "inside", "plain"], e[k[j], "inside", "fitted"]
    }' $thick > $out/thickness-rivals.md

# By scene.
awk -F, 'NR > 1 {
        key = $2 "," $3 "," $4 "," $5; e[$1, key] = $6
        if (!($1 in seen)) { seen[$1] = 1; s[++n] = $1 }
        if ($5 == "best" && $3 ~ /^one/) one[$4] = key
        if ($5 == "best" && $3 ~ /^each/) own[$4] = key
    }
    END {
        print "| scene | height field | constant | own constant | estimate | back faces | 4 layers | height field, inside | 1 layer | 2 layers | 4 layers | 8 layers | prototype, 4 layers |"
        print "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
        for (i = 1; i <= n; i++) {
            printf "| %s | %.4f | %.4f | %.4f | %.4f | %.4f | %.4f |", s[i], e[s[i], "height field,,rays,plain"], e[s[i], "constant," one_setting() ",rays,best"], e[s[i], "constant,each scene'"'"'s own,rays,best"], e[s[i], "estimate,,rays,plain"], e[s[i], "back faces,1,rays,plain"], e[s[i], "layers,4,rays,plain"]
            printf " %.4f | %.4f | %.4f | %.4f | %.4f | %.4f |\n", e[s[i], "height field,,inside,plain"], e[s[i], "back faces,1,inside,plain"], e[s[i], "layers,2,inside,plain"], e[s[i], "layers,4,inside,plain"], e[s[i], "layers,8,inside,plain"], e[s[i], "prototype,4,inside,plain"]
        }
    }
    function one_setting(  f) { split(one["rays"], f, ","); return f[2] }' $thick > $out/thickness-scenes.md

awk -F, 'BEGIN { print "| fitted to | factor | endless, radii | slope | RMSE there | height field | RMSE on the others | height field | ratio |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|" }
    NR > 1 { printf "| %s | %s | %s | %s | %.4f | %.4f | %s | %s | %s |\n", $1, $2, $3, $4, $5, $6, ($8 > 0 ? sprintf("%.4f", $7) : ""), ($8 > 0 ? sprintf("%.4f", $8) : ""), ($8 > 0 ? sprintf("%.2f", $7 / $8) : sprintf("%.2f", $5 / $6)) }' build/bench/thickness_fit.csv > $out/thickness-fit.md

awk -F, 'BEGIN { print "| scene | pieces | of which solids | pixels of sheets | with a second layer | third | fourth | fifth |\n|---|--:|--:|--:|--:|--:|--:|--:|" }
    NR > 1 { printf "| %s | %d | %d | %.0f %% | %.0f %% | %.0f %% | %.0f %% | %.0f %% |\n", $1, $2, $3, 100 * $4, 100 * $5, 100 * $6, 100 * $7, 100 * $8 }' build/bench/thickness_scenes.csv > $out/thickness-peel.md

awk -F, '{ e[$1, $2] = $3; if (!($1 in seen)) { seen[$1] = 1; s[++n] = $1 } if (!($2 in had)) { had[$2] = 1; w[++m] = $2 } sum[$2] += $3 * $3 }
    END {
        printf "| |"; for (i = 1; i <= n; i++) printf " %s |", s[i]; print " pooled |"
        printf "|---|"; for (i = 1; i <= n; i++) printf "--:|"; print "--:|"
        for (k = m; k >= 1; k--) { printf "| %dx%d |", w[k], w[k] * 9 / 16; for (i = 1; i <= n; i++) printf " %.3f |", e[s[i], w[k]]; printf " %.3f |\n", sqrt(sum[w[k]] / n) }
    }' build/bench/thickness_resolution.csv > $out/thickness-resolution.md

awk -F, '$1 == "pooled" && $5 == "plain" { e[$2, $3, $4] = $6 }
    END {
        a = e["estimate", "", "rays"] / e["height field", "", "rays"]; b = e["layers", "4", "inside"]
        printf "One layer with the estimated thickness: %.2f times the height field'"'"'s RMSE to ray tracing (goal: 0.6, %s). ", a, a <= 0.6 ? "met" : "not met"
        printf "Four two-sided layers: RMSE %.3f to ray tracing inside the view (goal: 0.03, %s); the prototype without a kernel'"'"'s economies: %.3f.\n", b, b <= 0.03 ? "met" : "not met", e["prototype", "4", "inside"]
    }' $thick > $out/thickness-goals.md

# What the program printed, as it is.
{ echo '```'; cat build/bench/multibounce.txt; echo '```'; } > $out/multibounce.md

# ---- docs -----------------------------------------------------------------------------------------------------------

[ "${1-}" = docs ] || exit 0
for f in build/bench/bench_*.svg; do cp "$f" docs/figures/; done
cp build/bench/crops.png docs/figures/bench_crops.png
cp build/bench/directional.png docs/figures/bench_directional.png
cp build/bench/thickness_crops.png docs/figures/bench_thickness_crops.png
exec tests/bench/insert.sh $out README.md docs/benchmark.md docs/accuracy.md docs/directional.md docs/thickness.md
