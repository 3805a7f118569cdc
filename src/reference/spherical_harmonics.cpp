// SPDX-License-Identifier: Apache-2.0
#include "reference/spherical_harmonics.h"

#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

std::array<glm::dvec3, kMaxCoefficients> sh_basis_gradient(int degree, const glm::dvec3& direction) {
    const double x = direction.x, y = direction.y, z = direction.z;
    const double xx = x * x, yy = y * y, zz = z * z, xy = x * y, xz = x * z, yz = y * z;
    std::array<glm::dvec3, kMaxCoefficients> gradient{};
    if (degree < 1) return gradient;
    gradient[1] = {0, -SH_C1, 0};
    gradient[2] = {0, 0, SH_C1};
    gradient[3] = {-SH_C1, 0, 0};
    if (degree < 2) return gradient;
    gradient[4] = SH_C2_0 * glm::dvec3(y, x, 0);
    gradient[5] = SH_C2_1 * glm::dvec3(0, z, y);
    gradient[6] = SH_C2_2 * glm::dvec3(-2 * x, -2 * y, 4 * z);
    gradient[7] = SH_C2_3 * glm::dvec3(z, 0, x);
    gradient[8] = SH_C2_4 * glm::dvec3(2 * x, -2 * y, 0);
    if (degree < 3) return gradient;
    gradient[9] = SH_C3_0 * glm::dvec3(6 * xy, 3 * xx - 3 * yy, 0);
    gradient[10] = SH_C3_1 * glm::dvec3(yz, xz, xy);
    gradient[11] = SH_C3_2 * glm::dvec3(-2 * xy, 4 * zz - xx - 3 * yy, 8 * yz);
    gradient[12] = SH_C3_3 * glm::dvec3(-6 * xz, -6 * yz, 6 * zz - 3 * xx - 3 * yy);
    gradient[13] = SH_C3_4 * glm::dvec3(4 * zz - 3 * xx - yy, -2 * xy, 8 * xz);
    gradient[14] = SH_C3_5 * glm::dvec3(2 * xz, -2 * yz, xx - yy);
    gradient[15] = SH_C3_6 * glm::dvec3(3 * xx - 3 * yy, -6 * xy, 0);
    return gradient;
}

}  // namespace ewa::reference
