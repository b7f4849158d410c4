// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>

namespace holdfast::imos {

/// Whether what belongs to the face gets there: mug to mouth, phone to ear. `object` and
/// `reference` (3 x T) are the object's translation as the head has it, R_head^T (T_object -
/// p_head) with joint 15's rotation and position, meters, a column per key frame, of which the
/// first `given` were given. The reference's place is where it is nearest to the head joint; the
/// error is how near `object` ever comes to that place, meters, whenever that is. Nothing where the
/// reference brings nothing to the face: it does when it comes within 0.25 m, and 0.1 m nearer than
/// in the last key frame given. Throws Error for sizes that differ or no key frame that was made.
std::optional<double> FaceError(const Eigen::Matrix3Xd& object, const Eigen::Matrix3Xd& reference,
                                int given);

}  // namespace holdfast::imos
