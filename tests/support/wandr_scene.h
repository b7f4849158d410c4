// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/random_stream.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/body_model.h"
#include "geometry/rotation.h"

/// Networks, poses, statistics and starts for tests of the WANDR generator.
namespace holdfast::wandr {

inline constexpr int kLatentSize = 64;  ///< of the published networks

/// Random weights of the published architecture, by the paper's widths if `hidden` is empty.
inline NetworkWeights RandomNetwork(IntentionLayout layout, std::uint64_t seed,
                                    const Statistics& statistics = {},
                                    int latent_size = kLatentSize,
                                    const std::vector<int>& hidden = {}) {
  const int condition = ConditionSize(layout);
  const auto make = [&](int input, int output, std::uint64_t which) {
    return nn::RandomMlp(input, hidden.empty() ? nn::TaperedWidths(input, output) : hidden, output,
                         2 * seed + which);
  };
  NetworkWeights weights;
  weights.layout = layout;
  weights.decoder = make(latent_size + condition, kStateSize, 0);
  weights.encoder = make(kStateSize + condition, 2 * latent_size, 1);
  weights.statistics = statistics;
  return weights;
}

/// The same with residual networks of `blocks` blocks of `width` values.
inline NetworkWeights RandomResidualNetwork(IntentionLayout layout, std::uint64_t seed,
                                            const Statistics& statistics, int latent_size,
                                            int width, int blocks) {
  const int condition = ConditionSize(layout);
  NetworkWeights weights;
  weights.layout = layout;
  weights.decoder =
      nn::RandomResidual(latent_size + condition, latent_size, width, blocks, kStateSize, 2 * seed);
  weights.encoder =
      nn::RandomResidual(kStateSize + condition, 0, width, blocks, 2 * latent_size, 2 * seed + 1);
  weights.statistics = statistics;
  return weights;
}

}  // namespace holdfast::wandr

namespace holdfast::wandr::testing {

inline const BodyMeasures& DefaultBody() {
  static const BodyMeasures body = MeasureBody(*BodyModel::Default(), Eigen::VectorXd());
  return body;
}

inline BoneOffsets<double> DefaultBones() { return BoneOffsetsOf(DefaultBody().rest_joints); }

/// Any pose at all, joints up to `spread` radians per axis, within two meters of the origin.
inline Pose<double> RandomPose(nn::RandomStream& random, double spread = 0.5) {
  const auto draw = [&] {
    return Eigen::Vector3d::NullaryExpr([&] { return 2.0 * random.Uniform() - 1.0; });
  };
  Pose<double> pose = StandingPose(DefaultBody());
  pose.translation += 2.0 * draw();
  for (Eigen::Matrix3d& R : pose.rotation) R = R * ExpSO3(spread * draw());
  pose.rotation[0] = ExpSO3({0.0, 0.0, 6.0 * random.Uniform()}) * pose.rotation[0];
  return pose;
}

/// The pose at a tangent step.
inline Pose<double> Perturbed(const Pose<double>& pose, const TangentVector<double>& step) {
  Pose<double> moved = pose;
  moved.translation += step.head<3>();
  for (int k = 0; k < kNumBodyJoints; ++k) {
    moved.rotation[k] = pose.rotation[k] * ExpSO3(step.segment<3>(TangentOf(k)));
  }
  return moved;
}

/// Statistics of the size that walking has: the network's random outputs become modest deltas.
inline Statistics WalkingStatistics() {
  Statistics s;
  s.body_transl.mean << 0.0, 0.0, 0.1;
  s.body_transl.deviation << 1.0, 1.0, 0.2;
  const Pose<double> standing = StandingPose(DefaultBody());
  const StateVector<double> state = StateOf(standing), rest = RestDelta<double>();
  s.body_orient.mean = s.body_orient_xy.mean = state.segment<6>(3);
  s.body_orient.deviation.setConstant(0.3);
  s.body_orient_xy.deviation.setConstant(0.2);
  s.body_orient_xy.mean[3] = s.body_orient_xy.deviation[3] = 0.0;
  s.body_pose.mean = state.tail<126>();
  s.body_pose.deviation.setConstant(0.25);
  s.body_transl_delta_pelv_xy.mean << 0.0, -0.015, 0.0;
  s.body_transl_delta_pelv_xy.deviation << 0.005, 0.01, 0.004;
  s.body_orient_delta.mean = rest.segment<6>(3);
  s.body_orient_delta.deviation.setConstant(0.02);
  s.body_pose_delta.mean = rest.tail<126>();
  s.body_pose_delta.deviation.setConstant(0.02);
  return s;
}

/// A network small enough for finite differences of everything.
inline NetworkWeights SmallNetwork(IntentionLayout layout, std::uint64_t seed) {
  return RandomNetwork(layout, seed, WalkingStatistics(), 8, {48, 64, 40});
}

/// The same with residual networks.
inline NetworkWeights SmallResidualNetwork(IntentionLayout layout, std::uint64_t seed) {
  return RandomResidualNetwork(layout, seed, WalkingStatistics(), 8, 40, 3);
}

/// `weights` with the decoder's last product scaled. Random weights make a chaotic loop (a
/// difference grows fourfold per step), trained ones a stable one: so does damping what it gives.
inline NetworkWeights WithScaledOutput(NetworkWeights weights, float factor) {
  if (auto* const chain = std::get_if<nn::MlpWeights>(&weights.decoder)) {
    chain->layers.back().weight *= factor;
  } else {
    std::get<nn::ResidualWeights>(weights.decoder).output_weight *= factor;
  }
  return weights;
}

inline RolloutStart<double> RandomStart(nn::RandomStream& random) {
  RolloutStart<double> start;
  start.pose = RandomPose(random, 0.3);
  for (double& value : start.previous_delta) value = 2.0 * random.Uniform() - 1.0;
  return start;
}

/// Central differences of a scalar function of `size` numbers around zero.
template <typename F>
Eigen::VectorXd NumericGradient(const F& f, Eigen::Index size, double step = 1e-6) {
  Eigen::VectorXd gradient(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double plus = f(Eigen::VectorXd(step * Eigen::VectorXd::Unit(size, i)));
    const double minus = f(Eigen::VectorXd(-step * Eigen::VectorXd::Unit(size, i)));
    gradient[i] = (plus - minus) / (2.0 * step);
  }
  return gradient;
}

/// Largest difference relative to the largest entry of `expected`.
inline double RelativeError(const Eigen::Ref<const Eigen::MatrixXd>& found,
                            const Eigen::Ref<const Eigen::MatrixXd>& expected) {
  if (!found.allFinite()) return INFINITY;
  return (found - expected).cwiseAbs().maxCoeff() / std::max(expected.cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace holdfast::wandr::testing
