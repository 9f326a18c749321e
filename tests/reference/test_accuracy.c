/* gtao.h against closed forms, the brute-force height field and the transcribed pseudo-code: what it computes, where
 * test_math.c checks how. */
#include "examples/common/image.h"
#include "tests/reference/library.h"

static const double pi = REF_PI;

/* ---- helpers ---- */

static size_t pixels_of(const ref_image *img) {
    return (size_t)img->width * (size_t)img->height;
}

static gtao_desc desc_of(const ref_image *img) {
    gtao_desc desc = describe_image(img);
    desc.noise = GTAO_NOISE_NONE;
    return desc;
}

static void set_normal(ref_image *img, int x, int y, const double normal[3]) {
    float *to = &img->normals[3 * ((size_t)y * (size_t)img->width + (size_t)x)];
    for (int i = 0; i < 3; i++)
        to[i] = (float)normal[i];
}

/* ---- open planes ---- */

static ref_shape plane_of(double tilt_degrees, double azimuth, double distance) {
    const double a = tilt_degrees * pi / 180.0;
    const ref_shape plane = {
        REF_PLANE, {0.0, 0.0, distance}, {sin(a) * cos(azimuth), sin(a) * sin(azimuth), -cos(a)}, 0.0, 0.0};
    return plane;
}

/* Where the plane is seen less than 0.05 degrees from edge-on, its normal as floats is not. */
static int faces_viewer(const ref_image *img, int x, int y) {
    const size_t at = (size_t)y * (size_t)img->width + (size_t)x;
    const float *n = &img->normals[3 * at];
    if (!isfinite(img->z[at]))
        return 0;
    if (img->orthographic)
        return (double)n[2] < -1e-3;
    const double r[3] = {(x + 0.5 - img->cx) / img->fx, (y + 0.5 - img->cy) / img->fy, 1.0};
    const double nr = (double)n[0] * r[0] + (double)n[1] * r[1] + (double)n[2];
    return nr < -1e-3 * sqrt(r[0] * r[0] + r[1] * r[1] + 1.0);
}

/* A slope can be told along both axes: on one side or the other two more pixels show the same plane. */
static int normal_is_told(const ref_image *img, int x, int y) {
    const float *here = &img->normals[3 * (y * img->width + x)];
    int told[2] = {0, 0};
    for (int side = 0; side < 4; side++) {
        const int dx = side < 2 ? 2 * side - 1 : 0, dy = side < 2 ? 0 : 2 * side - 5;
        int same = 1;
        for (int i = 1; i <= 2 && same; i++) {
            const int u = x + i * dx, v = y + i * dy;
            same = u >= 0 && v >= 0 && u < img->width && v < img->height && isfinite(img->z[v * img->width + u]) &&
                   memcmp(&img->normals[3 * (v * img->width + u)], here, 3 * sizeof *here) == 0;
        }
        told[side / 2] |= same;
    }
    return told[0] && told[1];
}

static void check_open(const ref_image *img, const gtao_desc *desc, const char *what) {
    result r = compute(desc);
    double worst = 0.0, worst_degrees = 0.0;
    int worst_at[2] = {0, 0};
    for (int y = 0; y < img->height; y++) {
        for (int x = 0; x < img->width; x++) {
            if (!faces_viewer(img, x, y) || (!desc->normals && !normal_is_told(img, x, y)))
                continue;
            const size_t at = (size_t)y * (size_t)img->width + (size_t)x;
            const double normal[3] = {(double)img->normals[3 * at], (double)img->normals[3 * at + 1],
                                      (double)img->normals[3 * at + 2]};
            const double error = fabs((double)r.visibility[at] - 1.0);
            const double degrees = degrees_between(&r.bent[3 * at], normal);
            if (!(error <= worst))
                worst = error, worst_at[0] = x, worst_at[1] = y;
            if (!(degrees <= worst_degrees))
                worst_degrees = degrees;
        }
    }
    CHECK(worst < 1e-3 && worst_degrees < 0.1,
          "%s, %d slices, %d steps%s, noise %d: visibility off by %g at %d %d, bent normal by %g degrees", what,
          desc->slices, desc->steps, desc->every_pixel ? " (every pixel)" : "", (int)desc->noise, worst, worst_at[0],
          worst_at[1], worst_degrees);
    result_free(&r);
}

static void open_planes(double fov_degrees, int derived) {
    static const int slices[] = {1, 2, 3, 4, 7, 16}, steps[] = {1, 3, 8, 0};
    static const gtao_noise noises[] = {GTAO_NOISE_MEMO, GTAO_NOISE_HILBERT, GTAO_NOISE_NONE};
    int variant = 0;
    for (int tilt = 0; tilt <= 80; tilt += 10) {
        for (size_t s = 0; s < 6; s++) {
            for (size_t j = 0; j < 4; j++, variant++) {
                ref_image img = fov_degrees > 0.0 ? ref_image_perspective(45, 33, fov_degrees)
                                                  : ref_image_orthographic(45, 33, 0.25);
                const ref_shape plane = plane_of(tilt, 0.7 * variant, 20.0);
                if (fov_degrees > 0.0 && variant % 5 == 0)
                    img.cx += 13.0, img.cy -= 6.0, img.fy *= 0.8;
                ref_render(&img, NULL, &plane, 1);
                gtao_desc desc = desc_of(&img);
                desc.radius = variant % 7 == 0 ? INFINITY : variant % 2 ? 4.0f : 12.0f;
                desc.falloff = variant % 3 == 0 ? 0.25f : 0.0f;
                desc.slices = slices[s];
                desc.steps = steps[j];
                desc.every_pixel = steps[j] == 0;
                desc.noise = noises[variant % 3];
                desc.frame = (uint32_t)variant;
                if (derived)
                    desc.normals = NULL;
                char what[64];
                snprintf(what, sizeof what, "tilt %d, field of view %g", tilt, fov_degrees);
                check_open(&img, &desc, what);
                ref_image_free(&img);
            }
        }
    }
}

static void open_planes_orthographic(void **state) {
    (void)state;
    open_planes(0.0, 0);
}

static void open_planes_20(void **state) {
    (void)state;
    open_planes(20.0, 0);
}

static void open_planes_60(void **state) {
    (void)state;
    open_planes(60.0, 0);
}

static void open_planes_100(void **state) {
    (void)state;
    open_planes(100.0, 0);
}

static void open_planes_140(void **state) {
    (void)state;
    open_planes(140.0, 0);
}

/* ---- analytic height fields ---- */

static gtao_desc reference_desc(const ref_image *img, double radius) {
    gtao_desc desc = desc_of(img);
    desc.radius = (float)radius;
    desc.slices = 64;
    desc.every_pixel = 1;
    return desc;
}

static void check_pixel_within(const ref_image *img, double radius, int x, int y, double visibility, double tolerance,
                               const double bent[3], double tolerance_degrees, const char *what, double parameter) {
    const gtao_desc desc = reference_desc(img, radius);
    result r = compute_rows(&desc, y, y + 1);
    const size_t at = (size_t)y * (size_t)img->width + (size_t)x;
    CHECK_NEAR(r.visibility[at], visibility, tolerance, "%s %g", what, parameter);
    CHECK(degrees_between(&r.bent[3 * at], bent) <= tolerance_degrees, "%s %g: bent normal off by %g degrees", what,
          parameter, degrees_between(&r.bent[3 * at], bent));
    result_free(&r);
}

static void check_pixel(const ref_image *img, int x, int y, double visibility, const double bent[3],
                        double tolerance_degrees, const char *what, double parameter) {
    check_pixel_within(img, HUGE_VAL, x, y, visibility, 0.005, bent, tolerance_degrees, what, parameter);
}

static void grooves_orthographic(void **state) {
    (void)state;
    const double up[3] = {0.0, 0.0, -1.0};
    /* Steeper walls move by more than 4 footprints a pixel, and their pixels no longer count as one surface. */
    for (int beta = 5; beta <= 75; beta += 5) {
        for (int turned = 0; turned < 2; turned++) {
            const double b = beta * pi / 180.0;
            ref_shape groove[2] = {{REF_PLANE, {5.05, 5.05, 20.0}, {-sin(b), 0.0, -cos(b)}, 0.0, 0.0},
                                   {REF_PLANE, {5.05, 5.05, 20.0}, {sin(b), 0.0, -cos(b)}, 0.0, 0.0}};
            for (int i = 0; i < 2 && turned; i++) {
                groove[i].axis[1] = groove[i].axis[0];
                groove[i].axis[0] = 0.0;
            }
            ref_image img = ref_image_orthographic(101, 101, 0.1);
            ref_render(&img, NULL, groove, 2);
            set_normal(&img, 50, 50, up);
            check_pixel(&img, 50, 50, cos(b), up, 0.05, "groove", beta);
            ref_image_free(&img);
        }
    }
}

/* Apex of a cone, exactly: cos^2(beta). Within a few pixels of the apex a chord between two pixels lies well above the
 * cone: the search must not take it for the surface. */
static void pit_apex(void **state) {
    (void)state;
    const double up[3] = {0.0, 0.0, -1.0};
    for (int beta = 5; beta <= 80; beta += 5) {
        const double b = beta * pi / 180.0;
        const ref_shape pit = {REF_CONE, {5.05, 5.05, 100.0}, {0.0, 0.0, -1.0}, tan(b), 0.0};
        ref_image img = ref_image_orthographic(101, 101, 0.1);
        ref_render(&img, NULL, &pit, 1);
        img.z[50 * 101 + 50] = 100.0f;
        set_normal(&img, 50, 50, up);
        check_pixel_within(&img, HUGE_VAL, 50, 50, cos(b) * cos(b), 0.005, up, 0.05, "apex of a pit", beta);
        ref_image_free(&img);
    }
}

/* Centre of a conical pit whose bottom is flat up to `flat` radii: the walls reach the elevation b where they leave the
 * radius, and cos^2(b) is visible. */
static double pit_elevation(double slope, double flat) {
    double low = 0.0, high = 0.5 * pi;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (slope * (cos(middle) - flat) > sin(middle))
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void pits_orthographic(void **state) {
    (void)state;
    const double up[3] = {0.0, 0.0, -1.0};
    for (int wall = 10; wall <= 70; wall += 10) {
        const double slope = tan(wall * pi / 180.0), b = pit_elevation(slope, 0.2);
        const ref_shape pit[2] = {{REF_CONE, {15.05, 15.05, 100.0 + 2.4 * slope}, {0.0, 0.0, -1.0}, slope, 0.0},
                                  {REF_PLANE, {15.05, 15.05, 100.0}, {0.0, 0.0, -1.0}, 0.0, 0.0}};
        ref_image img = ref_image_orthographic(301, 301, 0.1);
        ref_render(&img, NULL, pit, 2);
        check_pixel_within(&img, 12.0, 150, 150, cos(b) * cos(b), 0.005, up, 0.05, "pit", wall);
        ref_image_free(&img);
    }
}

/* The same seen obliquely and off the optical axis. */
static void pits_perspective(void **state) {
    (void)state;
    for (int wall = 10; wall <= 60; wall += 10) {
        for (int variant = 0; variant < 3; variant++) {
            const double slope = tan(wall * pi / 180.0), b = pit_elevation(slope, 0.2);
            ref_image img = ref_image_perspective(601, 601, 110.0);
            const int x = 300 + 20 * variant, y = 300 - 15 * variant;
            const double center[3] = {5.0 * (x + 0.5 - img.cx) / img.fx, 5.0 * (y + 0.5 - img.cy) / img.fy, 5.0};
            double up[3] = {0.0, 0.1 * variant, -1.0};
            const double size = sqrt(1.0 + 0.01 * variant * variant);
            ref_shape pit[2] = {{REF_CONE, {0.0}, {0.0}, slope, 0.0}, {REF_PLANE, {0.0}, {0.0}, 0.0, 0.0}};
            for (int i = 0; i < 3; i++) {
                up[i] /= size;
                pit[0].axis[i] = pit[1].axis[i] = up[i];
                pit[1].center[i] = center[i];
                pit[0].center[i] = center[i] - 0.4 * slope * up[i];
            }
            ref_render(&img, NULL, pit, 2);
            check_pixel_within(&img, 2.0, x, y, cos(b) * cos(b), 0.005, up, 0.3, "pit", wall);
            ref_image_free(&img);
        }
    }
}

/* The visible wedge next to a long wall: rays towards it below the elevation beta end there. */
static void wall_bent(double b, double to_wall, double up_sign, double bent[3]) {
    /* Integrals of cos(theta) w over the half space away and over the lune above the wall. */
    bent[0] = bent[1] = bent[2] = 0.0;
    for (int i = 0; i < 300; i++) {
        for (int j = 0; j < 300; j++) {
            const double theta = 0.5 * pi * (i + 0.5) / 300.0, psi = 2.0 * pi * (j + 0.5) / 300.0;
            const double x = sin(theta) * cos(psi), z = cos(theta);
            if (x > 0.0 && z < x * tan(b))
                continue;
            bent[0] += to_wall * x * cos(theta) * sin(theta);
            bent[2] += up_sign * z * cos(theta) * sin(theta);
        }
    }
}

static void walls_orthographic(void **state) {
    (void)state;
    enum { SIZE = 801, HERE = SIZE / 2 };
    for (int distance = 10; distance <= 30; distance += 10) {
        for (int beta = 10; beta <= 70; beta += 10) {
            const double b = beta * pi / 180.0, up[3] = {0.0, 0.0, -1.0};
            double bent[3];
            ref_image img = ref_image_orthographic(SIZE, SIZE, 0.5);
            for (int y = 0; y < SIZE; y++) {
                for (int x = 0; x < SIZE; x++) {
                    img.z[y * SIZE + x] = (float)(x < HERE + distance ? 500.0 : 500.0 - 0.5 * distance * tan(b));
                    set_normal(&img, x, y, up);
                }
            }
            wall_bent(b, 1.0, -1.0, bent);
            check_pixel(&img, HERE, HERE, 0.5 * (1.0 + cos(b)), bent, 0.5, "wall", beta);
            ref_image_free(&img);
        }
    }
}

/* Grooves seen obliquely and off the optical axis. The groove runs along a pixel row, whose view rays span a plane
 * with it, so that its bottom passes through pixel centres. */
static void grooves_perspective(void **state) {
    (void)state;
    for (int beta = 5; beta <= 50; beta += 5) {
        for (int variant = 0; variant < 6; variant++) {
            const double b = beta * pi / 180.0, along = 0.3 * (variant % 3 - 1), lean = 0.25 * (variant / 3);
            ref_image img = ref_image_perspective(301, 241, 70.0);
            const int x = 150 + 30 * (variant % 3), y = 120 - 35 * (variant / 3);
            /* The bottom's point and direction, the latter in the plane of the pixel row's rays. */
            const double ry = (y + 0.5 - img.cy) / img.fy;
            const double p[3] = {5.0 * (x + 0.5 - img.cx) / img.fx, 5.0 * ry, 5.0};
            const double l_size = sqrt(1.0 + along * along * (1.0 + ry * ry));
            const double l[3] = {1.0 / l_size, along * ry / l_size, along / l_size};
            /* An up vector perpendicular to it. */
            double up[3] = {0.0, lean, -1.0}, ul = up[0] * l[0] + up[1] * l[1] + up[2] * l[2];
            for (int i = 0; i < 3; i++)
                up[i] -= ul * l[i];
            const double up_size = sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
            for (int i = 0; i < 3; i++)
                up[i] /= up_size;
            const double m[3] = {up[1] * l[2] - up[2] * l[1], up[2] * l[0] - up[0] * l[2], up[0] * l[1] - up[1] * l[0]};
            ref_shape groove[2] = {{REF_PLANE, {p[0], p[1], p[2]}, {0.0}, 0.0, 0.0},
                                   {REF_PLANE, {p[0], p[1], p[2]}, {0.0}, 0.0, 0.0}};
            for (int i = 0; i < 3; i++) {
                groove[0].axis[i] = cos(b) * up[i] + sin(b) * m[i];
                groove[1].axis[i] = cos(b) * up[i] - sin(b) * m[i];
            }
            ref_render(&img, NULL, groove, 2);
            set_normal(&img, x, y, up);
            check_pixel(&img, x, y, cos(b), up, 0.2, "groove", beta);
            ref_image_free(&img);
        }
    }
}

/* A camera over a floor (y up in the scene) looks down at a long wall that stands along x. */
static void walls_perspective(void **state) {
    (void)state;
    for (int variant = 0; variant < 8; variant++) {
        const double eye[3] = {0.0, 6.0, -1.0}, target[3] = {0.3 * (variant % 3), 0.0, 1.2 + 0.2 * (variant % 2)};
        const double up[3] = {0.0, 1.0, 0.0}, height = 0.25 + 0.25 * (variant % 4);
        const ref_shape shapes[2] = {{REF_PLANE, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 0.0, 0.0},
                                     {REF_BOX, {0.0, 0.0, 52.0}, {1000.0, height, 50.0}, 0.0, 0.0}};
        const ref_pose pose = ref_pose_look(eye, target, up);
        ref_image img = ref_image_perspective(701, 501, 80.0);
        ref_render(&img, &pose, shapes, 2);
        /* A floor pixel some way below the wall's foot in the middle column. */
        const int x = 350 + 10 * (variant % 3), y = 300 + 5 * variant;
        const size_t at = (size_t)y * (size_t)img.width + (size_t)x;
        const double z = (double)img.z[at], vx = z * (x + 0.5 - img.cx) / img.fx, vy = z * (y + 0.5 - img.cy) / img.fy;
        const double scene_y = eye[1] + pose.right[1] * vx + pose.down[1] * vy + pose.forward[1] * z;
        const double scene_z = eye[2] + pose.right[2] * vx + pose.down[2] * vy + pose.forward[2] * z;
        CHECK_NEAR(scene_y, 0.0, 1e-4, "not on the floor, variant %d", variant);
        CHECK(scene_z < 1.9, "too near the wall, variant %d", variant);
        const double b = atan(height / (2.0 - scene_z));
        double local[3], bent[3];
        wall_bent(b, 1.0, 1.0, local);
        /* local: x towards the wall (scene z), z up (scene y) */
        bent[0] = pose.right[2] * local[0] + pose.right[1] * local[2];
        bent[1] = pose.down[2] * local[0] + pose.down[1] * local[2];
        bent[2] = pose.forward[2] * local[0] + pose.forward[1] * local[2];
        check_pixel(&img, x, y, 0.5 * (1.0 + cos(b)), bent, 0.7, "wall, variant", variant);
        ref_image_free(&img);
    }
}

/* ---- scenes ---- */

typedef struct scene {
    ref_image img;
    double radius;
} scene;

/* "key": number, number, ... of a flat JSON file. */
static void read_numbers(const char *path, const char *key, double *numbers, int count) {
    char text[4096], quoted[64];
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL, "%s: cannot be opened", path);
    const size_t size = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[size] = 0;
    snprintf(quoted, sizeof quoted, "\"%s\"", key);
    char *at = strstr(text, quoted);
    CHECK(at != NULL, "%s: no %s", path, key);
    at += strlen(quoted);
    for (int i = 0; i < count; i++) {
        at += strcspn(at, "0123456789-");
        numbers[i] = strtod(at, &at);
    }
}

static scene rendered_scene(const char *name) {
    char exr[64], json[64];
    image depth, normals;
    image_error error;
    double rows[9], focal, radius;
    snprintf(exr, sizeof exr, "tests/data/%s.exr", name);
    snprintf(json, sizeof json, "tests/data/%s.json", name);
    CHECK(image_read_depth(exr, &depth, &error), "%s", error.text);
    CHECK(image_read_normals(exr, &normals, &error), "%s", error.text);
    read_numbers(json, "focal_px", &focal, 1);
    read_numbers(json, "ao_distance", &radius, 1);
    read_numbers(json, "world_to_view_rows_right_up_back", rows, 9);

    scene s = {ref_image_perspective(depth.width, depth.height, 60.0), radius};
    s.img.fx = s.img.fy = focal;
    for (size_t i = 0; i < pixels_of(&s.img); i++) {
        const float z = depth.data[i];
        const double sign[3] = {1.0, -1.0, -1.0}; /* right, up, back to right, down, forward */
        double normal[3];
        s.img.z[i] = z < 1e9f ? z : INFINITY;
        for (size_t k = 0; k < 3; k++) {
            double sum = 0.0;
            for (size_t j = 0; j < 3; j++)
                sum += rows[3 * k + j] * (double)normals.data[3 * i + j];
            normal[k] = sign[k] * sum;
        }
        /* Averaged over the pixel's filter, so not of unit length at edges. */
        const double size = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        for (size_t k = 0; k < 3; k++)
            s.img.normals[3 * i + k] = (float)(size > 0.0 ? normal[k] / size : 0.0);
    }
    image_free(&depth);
    image_free(&normals);
    return s;
}

static scene cluttered_scene(void) {
    ref_shape shapes[16];
    const int count = ref_cluttered_scene(shapes, 16);
    scene s = {ref_image_perspective(480, 320, 75.0), 0.8};
    s.img.cx += 40.0; /* off-centre */
    ref_render(&s.img, NULL, shapes, count);
    return s;
}

/* The same room through an orthographic camera. */
static scene cluttered_orthographic_scene(void) {
    const double eye[3] = {-2.4, -1.4, 0.0};
    const ref_pose pose = {
        {eye[0], eye[1], eye[2]}, {1.0, 0.0, 0.0}, {0.0, 0.9805807, -0.1961161}, {0.0, 0.1961161, 0.9805807}};
    ref_shape shapes[16];
    const int count = ref_cluttered_scene(shapes, 16);
    scene s = {ref_image_orthographic(400, 300, 0.0125), 0.8};
    ref_render(&s.img, &pose, shapes, count);
    return s;
}

/* Terrain; the normals are given, from central differences. */
static scene terrain_scene(void) {
    image elevation;
    image_error error;
    CHECK(image_read_depth("tests/data/jacksboro.pfm", &elevation, &error), "%s", error.text);
    scene s = {ref_image_orthographic(elevation.width, elevation.height, 92.0), 8000.0};
    s.img.sx = 75.0;
    const int width = s.img.width, height = s.img.height;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const int x0 = x > 0 ? x - 1 : x, x1 = x < width - 1 ? x + 1 : x;
            const int y0 = y > 0 ? y - 1 : y, y1 = y < height - 1 ? y + 1 : y;
            const double dx =
                (double)(elevation.data[y * width + x1] - elevation.data[y * width + x0]) / ((x1 - x0) * s.img.sx);
            const double dy =
                (double)(elevation.data[y1 * width + x] - elevation.data[y0 * width + x]) / ((y1 - y0) * s.img.sy);
            const double size = sqrt(1.0 + dx * dx + dy * dy), normal[3] = {-dx / size, -dy / size, -1.0 / size};
            set_normal(&s.img, x, y, normal);
            s.img.z[y * width + x] = 5000.0f - elevation.data[y * width + x];
        }
    }
    image_free(&elevation);
    return s;
}

/* ---- against brute force ---- */

static int compare_doubles(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

typedef struct comparison {
    double rmse, mean, bent_95; /* degrees */
    int pixels;
} comparison;

static comparison compare(const ref_image *img, const gtao_desc *desc, const ref_settings *settings, int stride) {
    result r = compute(desc);
    double *degrees = allocate(pixels_of(img) * sizeof *degrees);
    comparison c = {0};
    for (int y = stride / 2; y < img->height; y += stride) {
        for (int x = stride / 2; x < img->width; x += stride) {
            const size_t at = (size_t)y * (size_t)img->width + (size_t)x;
            CHECK(isfinite(img->z[at]) || r.visibility[at] == 1.0f, "sky at %d %d: %g", x, y, (double)r.visibility[at]);
            if (!faces_viewer(img, x, y))
                continue;
            double bent[3];
            const double off = (double)r.visibility[at] - ref_heightfield(img, settings, x, y, bent);
            c.rmse += off * off;
            c.mean += off;
            degrees[c.pixels++] = degrees_between(&r.bent[3 * at], bent);
        }
    }
    CHECK(c.pixels > 500, "only %d pixels", c.pixels);
    c.rmse = sqrt(c.rmse / c.pixels);
    c.mean /= c.pixels;
    qsort(degrees, (size_t)c.pixels, sizeof *degrees, compare_doubles);
    c.bent_95 = degrees[c.pixels * 95 / 100];
    free(degrees);
    result_free(&r);
    return c;
}

static void check_scene(scene s, const char *name, int stride) {
    static const struct {
        double step_px, falloff;
        int uniform;
        gtao_noise noise;
        const char *what;
    } variants[] = {
        {1.0, 0.0, 0, GTAO_NOISE_NONE, "unit steps"}, {0.5, 0.0, 0, GTAO_NOISE_NONE, "half steps"},
        {1.0, 0.25, 0, GTAO_NOISE_NONE, "falloff"},   {1.0, 0.25, 0, GTAO_NOISE_MEMO, "falloff, other slice angles"},
        {1.0, 0.0, 1, GTAO_NOISE_NONE, "uniform"},
    };
    for (size_t i = 0; i < sizeof variants / sizeof variants[0]; i++) {
        gtao_desc desc = desc_of(&s.img);
        const ref_settings settings = {s.radius,        variants[i].falloff, 32, NULL, variants[i].step_px,
                                       REF_BORDER_OPEN, variants[i].uniform};
        desc.radius = (float)s.radius;
        desc.falloff = (float)variants[i].falloff;
        desc.slices = 32;
        desc.every_pixel = 1;
        desc.noise = variants[i].noise;
        desc.weighting = variants[i].uniform ? GTAO_WEIGHTING_UNIFORM : GTAO_WEIGHTING_COSINE;
        const comparison c = compare(&s.img, &desc, &settings, stride);
        printf("# note: %s, %s: %d pixels, RMSE %.4f, mean %+.4f, bent normals %.2f degrees at 95 %%\n", name,
               variants[i].what, c.pixels, c.rmse, c.mean, c.bent_95);
        CHECK(c.rmse < 0.01, "%s, %s: RMSE %g", name, variants[i].what, c.rmse);
        /* Bent normals depend more on where the slices are, and on grazing directions if these count in full. */
        const int strict = variants[i].noise == GTAO_NOISE_NONE && !variants[i].uniform;
        CHECK(c.bent_95 < (strict ? 1.0 : 1.5), "%s, %s: bent normals off by %g degrees", name, variants[i].what,
              c.bent_95);
    }
    ref_image_free(&s.img);
}

static void brute_force_study(void **state) {
    (void)state;
    check_scene(rendered_scene("study"), "study", 13);
}

static void brute_force_courtyard(void **state) {
    (void)state;
    check_scene(rendered_scene("courtyard"), "courtyard", 13);
}

static void brute_force_scans(void **state) {
    (void)state;
    check_scene(rendered_scene("scans"), "scans", 13);
}

static void brute_force_cluttered(void **state) {
    (void)state;
    check_scene(cluttered_scene(), "cluttered room", 11);
}

static void brute_force_cluttered_orthographic(void **state) {
    (void)state;
    check_scene(cluttered_orthographic_scene(), "cluttered room, orthographic", 11);
}

/* So near that the sphere of the radius is far from round on the screen, and in part behind the eye. */
static void brute_force_near(void **state) {
    (void)state;
    ref_shape shapes[16];
    const int count = ref_cluttered_scene(shapes, 16);
    scene s = {ref_image_perspective(320, 200, 110.0), 2.0};
    ref_render(&s.img, NULL, shapes, count);
    check_scene(s, "cluttered room, near", 9);
}

static void brute_force_terrain(void **state) {
    (void)state;
    check_scene(terrain_scene(), "terrain", 11);
}

/* ---- symmetries ---- */

/* The scene cropped to a size that is quick and odd. */
static ref_image crop(const ref_image *from, int left, int top, int width, int height) {
    ref_image to = ref_image_perspective(width, height, 60.0);
    float *z = to.z, *normals = to.normals;
    to = *from;
    to.z = z;
    to.normals = normals;
    to.width = width;
    to.height = height;
    to.cx = from->cx - left;
    to.cy = from->cy - top;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const int source = (y + top) * from->width + x + left;
            z[y * width + x] = from->z[source];
            memcpy(&normals[3 * (y * width + x)], &from->normals[3 * source], 3 * sizeof *normals);
        }
    }
    return to;
}

static void scaling_changes_no_bit(void **state) {
    (void)state;
    scene scenes[2] = {cluttered_scene(), cluttered_orthographic_scene()};
    for (int variant = 0; variant < 8; variant++) {
        const scene *s = &scenes[variant & 1];
        ref_image img = crop(&s->img, 90, 70, 131, 97);
        result first = {NULL, NULL, NULL};
        gtao_desc desc = desc_of(&img);
        float *scaled = allocate(pixels_of(&img) * sizeof *scaled);
        desc.depth = scaled;
        desc.noise = GTAO_NOISE_MEMO;
        desc.slices = 2;
        desc.steps = 6;
        desc.every_pixel = variant >> 1 & 1;
        desc.falloff = variant & 2 ? 0.25f : 0.0f;
        desc.estimator = variant == 4 ? GTAO_ESTIMATOR_MEMO : GTAO_ESTIMATOR_NORMALIZED;
        if (variant >> 2 & 1)
            desc.normals = NULL;
        for (int step = 0; step <= 40; step++) {
            /* 0, 1, -1, 2, -2, ... */
            const int k = step & 1 ? (step + 1) / 2 : -step / 2;
            for (size_t i = 0; i < pixels_of(&img); i++)
                scaled[i] = ldexpf(img.z[i], k);
            desc.radius = ldexpf((float)s->radius, k);
            desc.camera.sx = ldexpf((float)img.sx, k);
            desc.camera.sy = ldexpf((float)img.sy, k);
            result r = compute(&desc);
            if (!first.visibility) {
                first = r;
                continue;
            }
            for (size_t i = 0; i < pixels_of(&img); i++) {
                CHECK(memcmp(&r.visibility[i], &first.visibility[i], sizeof(float)) == 0 &&
                          memcmp(&r.bent[3 * i], &first.bent[3 * i], 3 * sizeof(float)) == 0,
                      "variant %d, 2^%d, pixel %d %d: %.9g, was %.9g", variant, k, (int)i % img.width,
                      (int)i / img.width, (double)r.visibility[i], (double)first.visibility[i]);
            }
            result_free(&r);
        }
        result_free(&first);
        free(scaled);
        ref_image_free(&img);
    }
    ref_image_free(&scenes[0].img);
    ref_image_free(&scenes[1].img);
}

/* Pixel (x, y) of the turned image shows pixel (*from_x, *from_y). Bit 0 mirrors x, bit 1 mirrors y, bit 2 then swaps. */
static void turned_from(int turn, const ref_image *img, int x, int y, int *from_x, int *from_y) {
    const int u = turn & 4 ? y : x, v = turn & 4 ? x : y;
    *from_x = turn & 1 ? img->width - 1 - u : u;
    *from_y = turn & 2 ? img->height - 1 - v : v;
}

static void turn_vector(int turn, const float from[3], float to[3]) {
    const float x = turn & 1 ? -from[0] : from[0], y = turn & 2 ? -from[1] : from[1];
    to[0] = turn & 4 ? y : x;
    to[1] = turn & 4 ? x : y;
    to[2] = from[2];
}

static ref_image turned(int turn, const ref_image *img) {
    const int swap = turn >> 2 & 1;
    ref_image to = ref_image_perspective(swap ? img->height : img->width, swap ? img->width : img->height, 60.0);
    const double cx = turn & 1 ? img->width - img->cx : img->cx;
    const double cy = turn & 2 ? img->height - img->cy : img->cy;
    to.orthographic = img->orthographic;
    to.fx = swap ? img->fy : img->fx;
    to.fy = swap ? img->fx : img->fy;
    to.cx = swap ? cy : cx;
    to.cy = swap ? cx : cy;
    to.sx = swap ? img->sy : img->sx;
    to.sy = swap ? img->sx : img->sy;
    for (int y = 0; y < to.height; y++) {
        for (int x = 0; x < to.width; x++) {
            int fx, fy;
            turned_from(turn, img, x, y, &fx, &fy);
            to.z[y * to.width + x] = img->z[fy * img->width + fx];
            turn_vector(turn, &img->normals[3 * (fy * img->width + fx)], &to.normals[3 * (y * to.width + x)]);
        }
    }
    return to;
}

static void mirrored_input_mirrors_output(void **state) {
    (void)state;
    scene scenes[2] = {cluttered_scene(), cluttered_orthographic_scene()};
    for (int variant = 0; variant < 8; variant++) {
        const scene *s = &scenes[variant & 1];
        ref_image img = crop(&s->img, 90, 70, 157, 102);
        for (int turn = 0; turn < 8; turn++) {
            ref_image other = turned(turn, &img);
            gtao_desc desc[2] = {desc_of(&img), desc_of(&other)};
            for (int i = 0; i < 2; i++) {
                desc[i].radius = (float)s->radius;
                desc[i].slices = 6;
                desc[i].steps = 7;
                desc[i].every_pixel = variant >> 1 & 1;
                desc[i].estimator = variant >> 2 & 1 ? GTAO_ESTIMATOR_MEMO : GTAO_ESTIMATOR_NORMALIZED;
                desc[i].falloff = variant >> 2 & 1 ? 0.5f : 0.0f;
            }
            result a = compute(&desc[0]), b = compute(&desc[1]);
            for (int y = 0; y < other.height; y++) {
                for (int x = 0; x < other.width; x++) {
                    int fx, fy;
                    turned_from(turn, &img, x, y, &fx, &fy);
                    const int at = y * other.width + x, from = fy * img.width + fx;
                    float bent[3];
                    CHECK_NEAR(b.visibility[at], a.visibility[from], 1e-5, "variant %d, turn %d, pixel %d %d", variant,
                               turn, fx, fy);
                    turn_vector(turn, &a.bent[3 * from], bent);
                    /* The memo's sum can exceed 1, where rounding decides which bent normal there is. */
                    if (desc[0].estimator == GTAO_ESTIMATOR_MEMO && a.visibility[from] > 0.99999f)
                        continue;
                    for (int k = 0; k < 3; k++)
                        CHECK_NEAR(b.bent[3 * at + k], bent[k], 1e-4, "variant %d, turn %d, pixel %d %d: bent normal",
                                   variant, turn, fx, fy);
                }
            }
            result_free(&a);
            result_free(&b);
            ref_image_free(&other);
        }
        ref_image_free(&img);
    }
    ref_image_free(&scenes[0].img);
    ref_image_free(&scenes[1].img);
}

/* ---- the memo's estimator ---- */

static void check_memo(const scene *s, const char *name, int slices, int steps, float falloff, int cap,
                       unsigned frame) {
    const ref_image *img = &s->img;
    const size_t count = pixels_of(img);
    const float radius = (float)s->radius;
    float direction[16], offset[16], *expected[3];
    gtao_desc desc = desc_of(img);
    desc.estimator = GTAO_ESTIMATOR_MEMO;
    desc.noise = GTAO_NOISE_MEMO;
    desc.frame = frame;
    desc.radius = radius;
    desc.falloff = falloff;
    desc.max_radius_px = cap;
    desc.slices = slices;
    desc.steps = steps;
    result r = compute(&desc);
    memo_noise(frame, direction, offset);
    for (int i = 0; i < 3; i++) {
        /* A sample at the very radius, or a radius at the edge of its class, is in or out by rounding: so are the results
         * at a radius a little smaller and larger. */
        const memo_settings settings = {slices, steps,
                                        radius * (1.0f + 1e-5f * (float)(i == 1   ? 1
                                                                         : i == 2 ? -1
                                                                                  : 0)),
                                        falloff, cap};
        expected[i] = allocate(count * sizeof(float));
        memo_gtao(img->width, img->height, img->z, img->normals, (float)img->fx, (float)img->cx, (float)img->cy,
                  &settings, direction, offset, expected[i]);
    }
    size_t rounded = 0;
    for (size_t i = 0; i < count; i++) {
        if (!faces_viewer(img, (int)i % img->width, (int)i / img->width))
            continue;
        double off = 1.0;
        for (int k = 0; k < 3; k++) /* the pseudo-code can leave [0, 1] */
            off = fmin(off, fabs((double)r.visibility[i] - fmax(0.0, fmin(1.0, (double)expected[k][i]))));
        /* The pseudo-code itself loses digits where it subtracts float positions of neighbours. */
        rounded += off >= 1e-4;
        CHECK(off < 1e-3, "%s, %d slices, %d steps, falloff %g, frame %u, pixel %d %d: %.6f, expected %.6f", name,
              slices, steps, (double)falloff, frame, (int)i % img->width, (int)i / img->width, (double)r.visibility[i],
              (double)expected[0][i]);
    }
    CHECK(rounded * 2000 < count, "%s: %zu of %zu pixels off by more than 1e-4", name, rounded, count);
    for (int i = 0; i < 3; i++)
        free(expected[i]);
    result_free(&r);
}

static void memo_on_scenes(void **state) {
    (void)state;
    static const char *const names[] = {"study", "courtyard", "scans"};
    for (unsigned i = 0; i < 3; i++) {
        scene s = rendered_scene(names[i]);
        check_memo(&s, names[i], 1, 8, 0.25f, 100, 3 * i);
        check_memo(&s, names[i], 2, 5, 0.0f, 64, 1 + 4 * i);
        ref_image_free(&s.img);
    }
}

static void memo_in_all_phases(void **state) {
    (void)state;
    scene whole = cluttered_scene(), s = {crop(&whole.img, 200, 120, 133, 101), whole.radius};
    for (unsigned frame = 0; frame < 24; frame++) {
        check_memo(&s, "cluttered room", 1 + (int)(frame % 3), 8, frame & 1 ? 0.25f : 0.0f, 200, frame);
        check_memo(&s, "cluttered room", 1 + (int)(frame % 2), 4, frame & 1 ? 0.0f : 1.0f, 50, frame);
    }
    ref_image_free(&whole.img);
    ref_image_free(&s.img);
}

/* ---- normals from depth ---- */

/* With nothing in reach the bent normal is the normal. */
static result derived_normals(const ref_image *img) {
    gtao_desc desc = desc_of(img);
    desc.normals = NULL;
    desc.radius = 0.0f;
    return compute(&desc);
}

static void check_derived(const ref_image *img, const char *what) {
    result r = derived_normals(img);
    int checked = 0;
    for (int y = 0; y < img->height; y++) {
        for (int x = 0; x < img->width; x++) {
            if (!faces_viewer(img, x, y) || !normal_is_told(img, x, y))
                continue;
            checked++;
            const size_t at = (size_t)y * (size_t)img->width + (size_t)x;
            const double normal[3] = {(double)img->normals[3 * at], (double)img->normals[3 * at + 1],
                                      (double)img->normals[3 * at + 2]};
            const double degrees = degrees_between(&r.bent[3 * at], normal);
            CHECK(degrees < 0.1, "%s: off by %g degrees at %d %d", what, degrees, x, y);
        }
    }
    CHECK(checked * 4 > img->width * img->height, "%s: only %d pixels", what, checked);
    result_free(&r);
}

static void derived_normals_on_planes(void **state) {
    (void)state;
    static const double fovs[] = {0.0, 20.0, 60.0, 110.0};
    for (int f = 0; f < 4; f++) {
        for (int tilt = 0; tilt <= 70; tilt += 10) {
            ref_image img = f ? ref_image_perspective(37, 29, fovs[f]) : ref_image_orthographic(37, 29, 0.25);
            const ref_shape plane = plane_of(tilt, 0.4 * tilt + f, 20.0);
            char what[64];
            snprintf(what, sizeof what, "tilt %d, field of view %g", tilt, fovs[f]);
            ref_render(&img, NULL, &plane, 1);
            check_derived(&img, what);
            ref_image_free(&img);
        }
    }
}

static void derived_normals_at_steps(void **state) {
    (void)state;
    /* A tilted card in front of a wall tilted the other way: every pixel keeps its own plane's normal up to the edge. */
    for (int orthographic = 0; orthographic < 2; orthographic++) {
        for (int tilt = 0; tilt <= 60; tilt += 10) {
            ref_image img = orthographic ? ref_image_orthographic(61, 53, 0.25) : ref_image_perspective(61, 53, 50.0);
            ref_image back = orthographic ? ref_image_orthographic(61, 53, 0.25) : ref_image_perspective(61, 53, 50.0);
            const ref_shape card = plane_of(tilt, 0.3 * tilt, 10.0), wall = plane_of(30.0, 2.0, 60.0);
            ref_render(&img, NULL, &card, 1);
            ref_render(&back, NULL, &wall, 1);
            for (int y = 0; y < img.height; y++) {
                for (int x = 0; x < img.width; x++) {
                    const int at = y * img.width + x;
                    /* Jagged edges that leave every card or wall pixel two neighbours in a row on one side. */
                    if (x > 14 + y / 4 && x < 45 && y > 11 && y < 40)
                        continue;
                    img.z[at] = back.z[at];
                    memcpy(&img.normals[3 * at], &back.normals[3 * at], 3 * sizeof(float));
                }
            }
            check_derived(&img, orthographic ? "steps, orthographic" : "steps");
            ref_image_free(&img);
            ref_image_free(&back);
        }
    }
}

static void derived_normals_at_folds(void **state) {
    (void)state;
    /* Floor and wall meet: no slope in between. */
    const ref_shape fold[2] = {{REF_PLANE, {0.0, 3.0, 20.0}, {0.0, -1.0, -0.2}, 0.0, 0.0},
                               {REF_PLANE, {0.0, 3.0, 20.0}, {0.3, 0.0, -1.0}, 0.0, 0.0}};
    ref_image img = ref_image_perspective(64, 48, 60.0);
    ref_render(&img, NULL, fold, 2);
    check_derived(&img, "fold");
    ref_image_free(&img);
}

static void open_planes_derived(void **state) {
    (void)state;
    open_planes(60.0, 1);
}

/* ---- what is read ---- */

static void depth_kinds_agree(void **state) {
    (void)state;
    scene whole = cluttered_scene();
    ref_image img = crop(&whole.img, 150, 90, 160, 120);
    const size_t count = pixels_of(&img);
    float *other = allocate(count * sizeof *other);
    gtao_desc desc = desc_of(&img);
    desc.radius = (float)whole.radius;
    desc.falloff = 0.25f;
    desc.slices = 4;
    desc.steps = 8;
    desc.noise = GTAO_NOISE_MEMO;
    result z = compute(&desc);
    desc.depth = other;
    for (int kind = 0; kind < 2; kind++) {
        for (size_t i = 0; i < count; i++) {
            const double depth = (double)img.z[i], rx = ((double)(i % 160) + 0.5 - img.cx) / img.fx,
                         ry = ((double)(i / 160) + 0.5 - img.cy) / img.fy;
            /* Reversed, near plane at 0.1, infinite. */
            other[i] = (float)(kind ? 0.1 / depth : depth * sqrt(1.0 + rx * rx + ry * ry));
        }
        desc.depth_kind = kind ? GTAO_DEPTH_DEVICE : GTAO_DEPTH_DISTANCE;
        desc.device_scale = kind ? 10.0f : 0.0f;
        result r = compute(&desc);
        double square = 0.0;
        for (size_t i = 0; i < count; i++) {
            const double off = (double)r.visibility[i] - (double)z.visibility[i];
            square += off * off;
        }
        CHECK(sqrt(square / (double)count) < 1e-3, "%s: RMSE %g", kind ? "device depth" : "distance",
              sqrt(square / (double)count));
        result_free(&r);
    }
    result_free(&z);
    free(other);
    ref_image_free(&img);
    ref_image_free(&whole.img);
}

static void borders_agree_with_brute_force(void **state) {
    (void)state;
    scene whole = terrain_scene();
    ref_image img = crop(&whole.img, 100, 100, 96, 80);
    for (int border = 0; border < 3; border++) {
        gtao_desc desc = desc_of(&img);
        const ref_settings settings = {whole.radius, 0.0, 32, NULL, 1.0, (ref_border)border, 0};
        desc.radius = (float)whole.radius;
        desc.slices = 32;
        desc.every_pixel = 1;
        desc.border = (gtao_border)border;
        const comparison c = compare(&img, &desc, &settings, 3);
        CHECK(c.rmse < 0.01 && c.bent_95 < 1.0, "border %d: RMSE %g, bent normals %g degrees", border, c.rmse,
              c.bent_95);
    }
    ref_image_free(&img);
    ref_image_free(&whole.img);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(open_planes_orthographic),
        cmocka_unit_test(open_planes_20),
        cmocka_unit_test(open_planes_60),
        cmocka_unit_test(open_planes_100),
        cmocka_unit_test(open_planes_140),
        cmocka_unit_test(open_planes_derived),
        cmocka_unit_test(grooves_orthographic),
        cmocka_unit_test(pit_apex),
        cmocka_unit_test(pits_orthographic),
        cmocka_unit_test(walls_orthographic),
        cmocka_unit_test(grooves_perspective),
        cmocka_unit_test(pits_perspective),
        cmocka_unit_test(walls_perspective),
        cmocka_unit_test(brute_force_study),
        cmocka_unit_test(brute_force_courtyard),
        cmocka_unit_test(brute_force_scans),
        cmocka_unit_test(brute_force_cluttered),
        cmocka_unit_test(brute_force_cluttered_orthographic),
        cmocka_unit_test(brute_force_near),
        cmocka_unit_test(brute_force_terrain),
        cmocka_unit_test(scaling_changes_no_bit),
        cmocka_unit_test(mirrored_input_mirrors_output),
        cmocka_unit_test(memo_on_scenes),
        cmocka_unit_test(memo_in_all_phases),
        cmocka_unit_test(derived_normals_on_planes),
        cmocka_unit_test(derived_normals_at_steps),
        cmocka_unit_test(derived_normals_at_folds),
        cmocka_unit_test(depth_kinds_agree),
        cmocka_unit_test(borders_agree_with_brute_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
