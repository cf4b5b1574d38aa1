// Rigid transforms, as few as a client needs.
#ifndef ALCES_CLIENT_RIGID_H
#define ALCES_CLIENT_RIGID_H

#include "alces/page.h"

typedef struct alces_page_rigid rigid;

// a_from_c = a_from_b * b_from_c
rigid rigid_product(const rigid* a_from_b, const rigid* b_from_c);
// b_from_a
rigid rigid_inverse(const rigid* a_from_b);
// Between two poses that are close together; fraction 0: `from`.
rigid rigid_between(const rigid* from, const rigid* to, double fraction);
// Where a body gets to that moves by `velocity` (along its own axes, m/s and rad/s) for so long.
rigid rigid_ahead(const rigid* pose, const double velocity[6], double duration_s);
// Angle of the rotation from one orientation to the other.
double rigid_angle_between(const rigid* a, const rigid* b);

// Covariance (client.h) of a body that was at `from` and is at `to`, a lever away.
void covariance_carry(const double covariance[36], const rigid* from, const rigid* to, double carried[36]);

#endif
