#include "rigid.h"

#include <math.h>

static void quaternion_product(const double a[4], const double b[4], double product[4]) {
  product[0] = a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1];
  product[1] = a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0];
  product[2] = a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3];
  product[3] = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2];
}

static void normalize(double q[4]) {
  const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0)) return;
  for (int i = 0; i < 4; ++i) q[i] /= length;
}

static void rotation_matrix(const double q[4], double m[9]) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  m[0] = 1 - 2 * (y * y + z * z);
  m[1] = 2 * (x * y - w * z);
  m[2] = 2 * (x * z + w * y);
  m[3] = 2 * (x * y + w * z);
  m[4] = 1 - 2 * (x * x + z * z);
  m[5] = 2 * (y * z - w * x);
  m[6] = 2 * (x * z - w * y);
  m[7] = 2 * (y * z + w * x);
  m[8] = 1 - 2 * (x * x + y * y);
}

static void rotate(const double q[4], const double v[3], double rotated[3]) {
  double m[9];
  rotation_matrix(q, m);
  for (int i = 0; i < 3; ++i) rotated[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

rigid rigid_product(const rigid* a_from_b, const rigid* b_from_c) {
  rigid product;
  rotate(a_from_b->orientation_xyzw, b_from_c->position_m, product.position_m);
  for (int i = 0; i < 3; ++i) product.position_m[i] += a_from_b->position_m[i];
  quaternion_product(a_from_b->orientation_xyzw, b_from_c->orientation_xyzw, product.orientation_xyzw);
  normalize(product.orientation_xyzw);
  return product;
}

rigid rigid_inverse(const rigid* a_from_b) {
  rigid inverse;
  for (int i = 0; i < 3; ++i) inverse.orientation_xyzw[i] = -a_from_b->orientation_xyzw[i];
  inverse.orientation_xyzw[3] = a_from_b->orientation_xyzw[3];
  rotate(inverse.orientation_xyzw, a_from_b->position_m, inverse.position_m);
  for (int i = 0; i < 3; ++i) inverse.position_m[i] = -inverse.position_m[i];
  return inverse;
}

// Between poses of a fiftieth of a second the chord is the arc, and the mean of quaternions their slerp.
rigid rigid_between(const rigid* from, const rigid* to, double fraction) {
  rigid between;
  double cosine = 0;
  for (int i = 0; i < 4; ++i) cosine += from->orientation_xyzw[i] * to->orientation_xyzw[i];
  const double sign = cosine < 0 ? -1 : 1;
  for (int i = 0; i < 3; ++i)
    between.position_m[i] = (1 - fraction) * from->position_m[i] + fraction * to->position_m[i];
  for (int i = 0; i < 4; ++i)
    between.orientation_xyzw[i] =
        (1 - fraction) * from->orientation_xyzw[i] + fraction * sign * to->orientation_xyzw[i];
  normalize(between.orientation_xyzw);
  return between;
}

rigid rigid_ahead(const rigid* pose, const double velocity[6], double duration_s) {
  const double* const turn_rad_s = velocity + 3;
  const double rate =
      sqrt(turn_rad_s[0] * turn_rad_s[0] + turn_rad_s[1] * turn_rad_s[1] + turn_rad_s[2] * turn_rad_s[2]);
  const double half = 0.5 * rate * duration_s;
  rigid step;
  rigid half_turn = {{0, 0, 0}, {0, 0, 0, 1}};
  for (int i = 0; i < 3; ++i) {
    step.orientation_xyzw[i] = rate > 0 ? turn_rad_s[i] / rate * sin(half) : 0;
    half_turn.orientation_xyzw[i] = rate > 0 ? turn_rad_s[i] / rate * sin(0.5 * half) : 0;
  }
  step.orientation_xyzw[3] = cos(half);
  half_turn.orientation_xyzw[3] = cos(0.5 * half);
  double way[3];
  for (int i = 0; i < 3; ++i) way[i] = velocity[i] * duration_s;
  rotate(half_turn.orientation_xyzw, way, step.position_m);  // the chord of the arc
  return rigid_product(pose, &step);
}

double rigid_angle_between(const rigid* a, const rigid* b) {
  double cosine = 0;
  for (int i = 0; i < 4; ++i) cosine += a->orientation_xyzw[i] * b->orientation_xyzw[i];
  const double bounded = fabs(cosine) < 1 ? fabs(cosine) : 1;
  return 2 * acos(bounded);
}

// J C J^T
static void sandwich(const double j[36], const double covariance[36], double result[36]) {
  double product[36];
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      double sum = 0;
      for (int k = 0; k < 6; ++k) sum += j[6 * row + k] * covariance[6 * k + column];
      product[6 * row + column] = sum;
    }
  }
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      double sum = 0;
      for (int k = 0; k < 6; ++k) sum += product[6 * row + k] * j[6 * column + k];
      result[6 * row + column] = sum;
    }
  }
}

// The place is off by what it was, and by the rotation's error times the lever.
void covariance_carry(const double covariance[36], const rigid* from, const rigid* to, double carried[36]) {
  double r[3];
  for (int i = 0; i < 3; ++i) r[i] = to->position_m[i] - from->position_m[i];
  double j[36] = {0};
  for (int i = 0; i < 6; ++i) j[7 * i] = 1;
  j[4] = r[2];
  j[5] = -r[1];
  j[9] = -r[2];
  j[11] = r[0];
  j[15] = r[1];
  j[16] = -r[0];
  sandwich(j, covariance, carried);
}
