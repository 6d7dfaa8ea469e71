// How different two colours look.
#pragma once

#include "color/matrix3.h"

namespace kanuka::color {

Vector3 lab_from_xyz(const Vector3& xyz, const Vector3& white); // CIE 15:2018, section 8.2.1
// CIEDE2000 (ISO/CIE 11664-6; G. Sharma, W. Wu, E. N. Dalal, Color Res. Appl. 30, 21, 2005), all k = 1.
double delta_e_2000(const Vector3& lab_a, const Vector3& lab_b);

} // namespace kanuka::color
