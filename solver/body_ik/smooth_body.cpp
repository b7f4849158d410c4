// SPDX-License-Identifier: MIT
#include "solver/body_ik/smooth_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

constexpr int kMaxSmoothIterations = 30;
constexpr double kMinNoise_rad = 0.3 * kDegree, kMinNoise_m = 0.001;
constexpr double kOutlier = 3.0;  // times the noise

// Rotation from a to b (quaternions x, y, z, w), as a rotation vector.
template <typename T>
Eigen::Matrix<T, 3, 1> TurnBetween(const T* a, const T* b) {
  const T conjugate[4] = {a[3], -a[0], -a[1], -a[2]}, to[4] = {b[3], b[0], b[1], b[2]};
  T between[4];
  ceres::QuaternionProduct(conjugate, to, between);
  Eigen::Matrix<T, 3, 1> turn;
  ceres::QuaternionToAngleAxis(between, turn.data());
  return turn;
}

// log(q0^-1 q).
struct NearRotation {
  Eigen::Quaterniond measured;
  template <typename T>
  bool operator()(const T* q, T* residual) const {
    const Eigen::Matrix<T, 4, 1> from = measured.coeffs().cast<T>();
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{residual} = TurnBetween(from.data(), q);
    return true;
  }
};

// w (log(b^-1 c) - log(a^-1 b)).
struct EvenRotation {
  double weight;
  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{residual} =
        T(weight) * (TurnBetween(b, c) - TurnBetween(a, b));
    return true;
  }
};

struct NearPlace {
  Eigen::Vector3d measured;
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{residual} =
        Eigen::Map<const Eigen::Matrix<T, 3, 1>>(x) - measured.cast<T>();
    return true;
  }
};

struct EvenPlace {
  double weight;
  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, T* residual) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    Eigen::Map<Vector>{residual} =
        T(weight) * (Eigen::Map<const Vector>(a) - T(2) * Eigen::Map<const Vector>(b) +
                     Eigen::Map<const Vector>(c));
    return true;
  }
};

// Standard deviation of one coordinate of white noise, from second differences (their variance is
// six times as large), by the median, which a smooth motion and outliers hardly change.
double NoiseOf(std::vector<double> second_differences, double least) {
  constexpr double kMedianOfNorm3 = 1.538;  // of a 3D normal distribution
  if (second_differences.empty()) return least;
  const auto middle = second_differences.begin() + std::ssize(second_differences) / 2;
  std::ranges::nth_element(second_differences, middle);
  return std::max(*middle / (std::sqrt(6.0) * kMedianOfNorm3), least);
}

double EvenWeight(double cutoff_hz, double rate_hz) {
  return std::pow(2.0 * std::sin(std::numbers::pi * cutoff_hz / rate_hz), -2.0);
}

// Solves by least squares, and again with a loss at three times the noise, or at three times what
// nine of ten frames are off by: a fast motion is no outlier. Returns the number of outliers.
int SolveRobustly(const std::function<std::vector<double>()>& distances, double noise,
                  ceres::LossFunctionWrapper& loss, ceres::Problem& problem) {
  constexpr double kNinthTenthOfNorm3 = 2.5;  // of a 3D normal distribution
  (void)SolveQuietly(SparseOptions(kMaxSmoothIterations, 1e-6), problem);
  std::vector<double> off = distances();
  const auto ninth = off.begin() + std::ssize(off) * 9 / 10;
  std::ranges::nth_element(off, ninth);
  const double scale = kOutlier * std::max(noise, *ninth / kNinthTenthOfNorm3);
  loss.Reset(new ceres::CauchyLoss(scale), ceres::TAKE_OWNERSHIP);
  (void)SolveQuietly(SparseOptions(kMaxSmoothIterations, 1e-6), problem);
  return static_cast<int>(
      std::ranges::count_if(distances(), [&](double distance) { return distance > 2.0 * scale; }));
}

// Smooths rotations in place; returns the number of outliers.
int SmoothRotations(double even_weight, std::vector<Eigen::Quaterniond>& turns) {
  const std::size_t frames = turns.size();
  for (std::size_t t = 1; t < frames; ++t) {
    if (turns[t].dot(turns[t - 1]) < 0.0) turns[t].coeffs() = -turns[t].coeffs();
  }
  const std::vector<Eigen::Quaterniond> measured = turns;
  std::vector<double> second;
  for (std::size_t t = 1; t + 1 < frames; ++t) {
    second.push_back((TurnBetween(turns[t].coeffs().data(), turns[t + 1].coeffs().data()) -
                      TurnBetween(turns[t - 1].coeffs().data(), turns[t].coeffs().data()))
                         .norm());
  }
  if (std::ranges::all_of(second, [](double size) { return size < 1e-9; })) return 0;
  RotationManifold manifold;
  ceres::LossFunctionWrapper loss(nullptr, ceres::TAKE_OWNERSHIP);
  ceres::Problem::Options borrowing;
  borrowing.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  borrowing.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(borrowing);
  for (std::size_t t = 0; t < frames; ++t) {
    problem.AddParameterBlock(turns[t].coeffs().data(), 4, &manifold);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<NearRotation, 3, 4>(new NearRotation{measured[t]}), &loss,
        turns[t].coeffs().data());
    if (t < 2) continue;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EvenRotation, 3, 4, 4, 4>(new EvenRotation{even_weight}),
        nullptr, turns[t - 2].coeffs().data(), turns[t - 1].coeffs().data(),
        turns[t].coeffs().data());
  }
  const auto distances = [&] {
    std::vector<double> result;
    for (std::size_t t = 0; t < frames; ++t) {
      result.push_back(turns[t].angularDistance(measured[t]));
    }
    return result;
  };
  return SolveRobustly(distances, NoiseOf(std::move(second), kMinNoise_rad), loss, problem);
}

int SmoothPlaces(double even_weight, Eigen::Matrix3Xd& places) {
  const Eigen::Index frames = places.cols();
  const Eigen::Matrix3Xd measured = places;
  std::vector<double> second;
  for (Eigen::Index t = 1; t + 1 < frames; ++t) {
    second.push_back((places.col(t - 1) - 2.0 * places.col(t) + places.col(t + 1)).norm());
  }
  ceres::LossFunctionWrapper loss(nullptr, ceres::TAKE_OWNERSHIP);
  ceres::Problem::Options borrowing;
  borrowing.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(borrowing);
  for (Eigen::Index t = 0; t < frames; ++t) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<NearPlace, 3, 3>(new NearPlace{measured.col(t)}), &loss,
        places.col(t).data());
    if (t < 2) continue;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EvenPlace, 3, 3, 3, 3>(new EvenPlace{even_weight}), nullptr,
        places.col(t - 2).data(), places.col(t - 1).data(), places.col(t).data());
  }
  const auto distances = [&] {
    std::vector<double> result;
    for (Eigen::Index t = 0; t < frames; ++t) {
      result.push_back((places.col(t) - measured.col(t)).norm());
    }
    return result;
  };
  return SolveRobustly(distances, NoiseOf(std::move(second), kMinNoise_m), loss, problem);
}

BodyJitter Measure(std::span<const BodyPlacement> placed, std::span<const Soles> soles,
                   std::span<const SoleBits> contacts, double rate_hz) {
  BodyJitter jitter;
  double sum = 0.0;
  for (std::size_t t = 3; t < placed.size(); ++t) {
    sum += (placed[t].joints - 3.0 * placed[t - 1].joints + 3.0 * placed[t - 2].joints -
            placed[t - 3].joints)
               .colwise()
               .norm()
               .mean();
  }
  if (placed.size() > 3) {
    jitter.jerk_m_s3 = sum / static_cast<double>(placed.size() - 3) * std::pow(rate_hz, 3);
  }
  double slid = 0.0;
  int count = 0;
  for (std::size_t t = 1; t < soles.size(); ++t) {
    for (int i = 0; i < GroundProbe::kNumSoles; ++i) {
      const auto bit = static_cast<SoleBits>(1U << static_cast<unsigned>(i));
      if ((contacts[t] & contacts[t - 1] & bit) == 0) continue;
      slid += (soles[t].col(i) - soles[t - 1].col(i)).head<2>().norm();
      ++count;
    }
  }
  if (count > 0) jitter.skate_mm_s = 1e3 * rate_hz * slid / count;
  return jitter;
}

void Require(const Clip& clip, const SmoothOptions& options, const std::string& where) {
  if (clip.object) {
    throw Error(where, "has an object: smoothing only the body would move the hand away from it",
                "Refine it without --smooth");
  }
  if (IsHandAlone(clip)) {
    throw Error(where, "is a hand alone", "Give a body; 'solve' smooths hands of keypoints");
  }
  if (clip.NumFrames() < 3) {
    throw Error(where, "has fewer than three frames", "Give a motion");
  }
  if (!(options.cutoff_hz < 0.5 * clip.frame_rate)) {
    throw Error("--smooth",
                fmt::format("is {:g} Hz, but the clip has {:g} frames a second", options.cutoff_hz,
                            clip.frame_rate),
                "Give less than half of the frame rate");
  }
}

}  // namespace

SmoothedBody SmoothBody(const Clip& clip, const ClipBody& body, const SmoothOptions& options,
                        const std::string& where, const StagedProgress& progress) {
  Require(clip, options, where);
  const auto tell = [&](const char* stage, int done, int total) {
    if (progress && !progress(stage, done, total)) throw WorkStopped();
  };
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  const double weight = EvenWeight(options.cutoff_hz, clip.frame_rate);
  SmoothedBody smoothed;
  smoothed.clip = clip;
  Clip& result = smoothed.clip;
  SmoothReport& report = smoothed.report;

  tell("smoothing", 0, kNumJoints + 1);
  std::array<int, kNumJoints> outliers{};
  ParallelFor(kNumJoints, options.threads, [&](int joint) {
    std::vector<Eigen::Quaterniond> turns;
    for (const JointPose& pose : clip.pose) {
      turns.emplace_back(ExpSO3(pose.col(joint)));
    }
    outliers[static_cast<std::size_t>(joint)] = SmoothRotations(weight, turns);
    for (std::size_t t = 0; t < frames; ++t) {
      const Eigen::Vector3d turn = LogSO3(turns[t].toRotationMatrix());
      result.pose[t].col(joint) =
          t > 0 ? UnwrapAxisAngle(turn, result.pose[t - 1].col(joint)) : turn;
    }
  });
  for (const int count : outliers) report.outliers += count;
  report.outliers += SmoothPlaces(weight, result.trans);

  const BodyMeasures measures = MeasureBody(*body.model, body.betas);
  const Eigen::Matrix3Xd& rest = measures.rest_joints;
  const SolePoints soles(rest, measures.sole_y);
  const std::vector<BodyPlacement> before = Place(rest, BodyFrames(clip, rest));
  std::vector<BodyFrame> body_frames = BodyFrames(result, rest);
  std::vector<BodyPlacement> placed = Place(rest, body_frames);
  const std::vector<Soles> points = soles.At(placed);
  // A body that hovers or sinks, such as one in a camera's frame, stands on no known ground.
  constexpr double kNearGround_m = 0.08;
  const auto near = std::ranges::count_if(
      points, [&](const Soles& sole) { return std::abs(sole.row(2).minCoeff()) < kNearGround_m; });
  const std::vector<SoleBits> contacts = FindSupports(points, clip.frame_rate);
  report.before = Measure(before, soles.At(before), contacts, clip.frame_rate);
  if (options.pin_feet && 2 * near > std::ssize(points)) {
    tell("pinning feet", kNumJoints, kNumJoints + 1);
    FootLockReport feet;
    LockFeet(rest, soles, contacts, body_frames, {}, &feet);
    SetBodyFrames(body_frames, rest, result);
    placed = Place(rest, body_frames);
    report.feet_pinned = true;
    report.max_foot_correction_m = feet.max_correction_m;
  } else if (options.pin_feet) {
    report.notes.push_back(fmt::format(
        "feet are not pinned: they are near the ground (z = 0) in {} of {} frames", near, frames));
  }
  report.after = Measure(placed, soles.At(placed), contacts, clip.frame_rate);
  double moved = 0.0;
  for (std::size_t t = 0; t < frames; ++t) {
    moved += (placed[t].joints - before[t].joints).colwise().squaredNorm().mean();
  }
  report.moved_mm = 1e3 * std::sqrt(moved / static_cast<double>(frames));
  return smoothed;
}

}  // namespace holdfast
