// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_correctives.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "meshes/make/body/body_skinning.h"
#include "meshes/make/body/hand_mean.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

/// Least squares for c in 1 / |A(w, theta)| - 1 = c (1 - cos theta) over bends up to 90 degrees.
double LengthFactor(double w) {
  constexpr int kSamples = 18;
  double numerator = 0, denominator = 0;
  for (int k = 1; k <= kSamples; ++k) {
    const double u = 1 - std::cos(0.5 * std::numbers::pi * k / kSamples);
    numerator += u * (1 / std::sqrt(1 - 2 * w * (1 - w) * u) - 1);
    denominator += u * u;
  }
  return numerator / denominator;
}

/// Where the flesh folds when the joint bends its usual way; zero for joints that turn every way.
Vector3d FlexorSide(int joint) {
  const std::string_view name = kJointNames[joint];
  if (joint >= kLeftHandBegin) {
    const bool left = joint < kRightHandBegin;
    const int finger = (joint - (left ? kLeftHandBegin : kRightHandBegin)) / 3;
    Vector3d palmar = -LeftDorsalDirection(static_cast<Finger>(finger));
    if (!left) palmar.x() = -palmar.x();
    return palmar;
  }
  if (name.ends_with("elbow")) return Vector3d::UnitZ();
  if (name.ends_with("knee")) return -Vector3d::UnitZ();
  return Vector3d::Zero();
}

}  // namespace

std::vector<float> PoseCorrectives(const BodyMesh& body, const Eigen::MatrixXd& weights) {
  constexpr int kFeatures = 9 * (kNumJoints - 1);
  // In the fold the skin of both bones meets: pushing it out by the full length would press it
  // through itself.
  constexpr double kShareInFold = 0.35;
  constexpr double kNegligible = 0.01;
  const RestJoints joints = DefaultRestJoints();
  const Eigen::Index num_vertices = body.mesh.NumVertices();
  std::vector<float> directions(static_cast<std::size_t>(num_vertices) * 3 * kFeatures, 0.0f);
  for (int joint = 1; joint < kNumJoints; ++joint) {
    const Eigen::VectorXd subtree = SubtreeWeights(weights, joint);
    const Eigen::VectorXd ancestors = AncestorWeights(weights, joint);
    const Vector3d flexor = FlexorSide(joint);
    for (Eigen::Index i = 0; i < num_vertices; ++i) {
      // A web between two fingers shares its weight with a sibling, which is no bend of this joint.
      const double both = subtree[i] + ancestors[i];
      if (subtree[i] * ancestors[i] < kNegligible) continue;
      const double w = subtree[i] / both;
      const Vector3d arm = body.mesh.vertices.col(i) - joints.col(joint);
      const double fold = std::clamp(arm.dot(flexor) / arm.norm(), 0.0, 1.0);
      const double c = both * LengthFactor(w) * (1 - (1 - kShareInFold) * fold);
      for (int a = 0; a < 3; ++a) {
        float* row = directions.data() +
                     (static_cast<std::size_t>(i) * 3 + static_cast<std::size_t>(a)) * kFeatures +
                     9 * (joint - 1);
        for (int b = 0; b < 3; ++b) {
          row[3 * a + b] += static_cast<float>(-0.5 * c * arm[b]);
          row[3 * b + a] += static_cast<float>(-0.5 * c * arm[b]);
        }
      }
    }
  }
  // A quarter of a micrometre is nothing to see, and round values compress.
  for (float& value : directions) {
    value = static_cast<float>(std::nearbyint(static_cast<double>(value) * 65536.0) / 65536.0);
  }
  return directions;
}

}  // namespace holdfast
