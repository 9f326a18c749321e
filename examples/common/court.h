/* court.h - the built-in scene of the viewer and the sequence: a walled court with a portico, a table, and a hoop with
 * a ball that fly around it. Metres; the floor is y = 0. */
#ifndef EXAMPLES_COURT_H
#define EXAMPLES_COURT_H

#include "mesh.h"

enum { COURT_FIXED, COURT_HOOP, COURT_BALL, COURT_PARTS };

void court_build(mesh *out); /* with normals */

/* Where a part is after `seconds` on its way; the fixed part stays. */
mesh_frame court_part(int part, double seconds);

#endif
