// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string_view>

#include "meshes/make/body/body_mesh.h"

namespace holdfast {

inline constexpr int kNumBetas = 10;

/// What each shape coefficient changes; one unit is about one standard deviation among adults.
extern const std::array<std::string_view, kNumBetas> kBetaNames;

/// Displacements of all vertices for a unit of each shape coefficient, (3 x V) each, metres.
/// Every bone scales about its own joint, along or across the bone, and carries what hangs on it;
/// the smoothed skinning weights blend between bones. Symmetric.
std::array<Eigen::Matrix3Xd, kNumBetas> ShapeDirections(const BodyMesh& body,
                                                        const Eigen::MatrixXd& weights);

}  // namespace holdfast
