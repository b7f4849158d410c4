// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/fit.h"

namespace holdfast {

/// The finger loss of IMoS's released code: one hand with N vertices v_j, against the M vertices of
/// a fixed object, all in the world and in meters:
///
///   L = 1/(3N) sum_j |w_j (D_j - D0_j)|^2  +  l_c mean{ d_p : p in S, d_p < tau }
///     + l_d/(3N) sum_j |v_j - v0_j|^2
///   D_j = (object vertex nearest to v_j) - v_j,   w_j = exp(-2 |D0_j|)
///
/// v0, D0 belong to the start fingers; nearest vertices are recomputed at each evaluation, and are
/// constant in the gradient. S is every M-th entry of the M x N distances in row-major order: an
/// arbitrary sample of N pairs. Without a pair below tau the second term is omitted.
class ImosFingerLoss {
 public:
  /// `state` must have its body set; it is modified and must outlive this. `object` (3 x M), world.
  ImosFingerLoss(HandState& state, const Eigen::Matrix3Xd& object, const FingerPose& start,
                 double lambda_contact, double lambda_drift, double tau_m);

  /// Returns L, and with `gradient` dL / d fingers.
  double Evaluate(const FingerPose& fingers, FingerPose* gradient);

 private:
  int Nearest(const Eigen::Vector3d& point);

  HandState& state_;
  Eigen::MatrixX3d object_;  // separate coordinates, for the search
  double lambda_contact_, lambda_drift_, tau_;
  Eigen::Matrix3Xd start_vertices_;  // v0
  Eigen::Matrix3Xd start_to_near_;   // D0
  Eigen::VectorXd weight_;           // w
  Eigen::Matrix3Xd slopes_;          // dL / dv
  Eigen::VectorXd squares_;          // scratch memory of the search
};

/// Adam (Kingma and Ba 2015, algorithm 1) with the usual constants. Keeps its moments between
/// calls.
class ReferenceAdam {
 public:
  explicit ReferenceAdam(Eigen::Index size)
      : mean_(Eigen::VectorXd::Zero(size)), square_(Eigen::VectorXd::Zero(size)) {}

  void Step(const Eigen::VectorXd& gradient, double learning_rate, Eigen::VectorXd& x) {
    constexpr double kMean = 0.9, kSquare = 0.999, kEpsilon = 1e-8;
    ++steps_;
    mean_ = kMean * mean_ + (1.0 - kMean) * gradient;
    square_ = kSquare * square_ + (1.0 - kSquare) * gradient.cwiseAbs2();
    const double mean_scale = 1.0 / (1.0 - std::pow(kMean, steps_));
    const double square_scale = 1.0 / (1.0 - std::pow(kSquare, steps_));
    x.array() -= learning_rate * mean_scale * mean_.array() /
                 ((square_scale * square_.array()).sqrt() + kEpsilon);
  }

 private:
  Eigen::VectorXd mean_, square_;
  int steps_ = 0;
};

/// Six-dimensional rotation (Zhou et al. 2019), in IMoS's order: the first two rows of R.
using Rotation6d = Eigen::Matrix<double, 6, 1>;

inline Rotation6d To6d(const Eigen::Matrix3d& R) {
  Rotation6d x;
  x << R.row(0).transpose(), R.row(1).transpose();
  return x;
}

/// Returns the rotation for x, by Gram-Schmidt. With `J_turn_x` (3 x 6) also its derivative: R(x +
/// dx) = exp([J_turn_x dx]x) R(x) to first order. The two rows must not be parallel.
inline Eigen::Matrix3d From6d(const Rotation6d& x, Eigen::Matrix<double, 3, 6>* J_turn_x) {
  const Eigen::Vector3d a1 = x.head<3>(), a2 = x.tail<3>();
  const double length1 = a1.norm();
  const Eigen::Vector3d b1 = a1 / length1;
  const double along = b1.dot(a2);
  const Eigen::Vector3d rest = a2 - along * b1;
  const double length2 = rest.norm();
  const Eigen::Vector3d b2 = rest / length2, b3 = b1.cross(b2);
  Eigen::Matrix3d R;
  R << b1.transpose(), b2.transpose(), b3.transpose();
  if (J_turn_x != nullptr) {
    for (int k = 0; k < 6; ++k) {
      const Rotation6d unit = Rotation6d::Unit(k);
      const Eigen::Vector3d da1 = unit.head<3>(), da2 = unit.tail<3>();
      const Eigen::Vector3d db1 = (da1 - b1.dot(da1) * b1) / length1;
      const Eigen::Vector3d d_rest = da2 - (db1.dot(a2) + b1.dot(da2)) * b1 - along * db1;
      const Eigen::Vector3d db2 = (d_rest - b2.dot(d_rest) * b2) / length2;
      Eigen::Matrix3d dR;
      dR << db1.transpose(), db2.transpose(), (db1.cross(b2) + b1.cross(db2)).transpose();
      const Eigen::Matrix3d turn = dR * R.transpose();  // skew
      J_turn_x->col(k) = Eigen::Vector3d(turn(2, 1), turn(0, 2), turn(1, 0));
    }
  }
  return R;
}

/// The algorithm of IMoS's released code, which differs from the paper (for which see FitClip with
/// FitOptions::OnlyPaper): first the object, from all pair distances with a fixed hand; then the
/// fingers, by 160 Adam steps against a fixed object. For comparison.
///
/// Preserved: the residuals of both stages, their starts, what is fixed, Adam with moments kept
/// between frames, the strided sample of the contact term, its current distances, the unused last
/// step, one hand even if two hold.
///
/// Not preserved: single precision and finite differences in the first stage (same optimum); object
/// rotations that act on row vectors; its first start, which pairs the object's rotation with the
/// body's translation; the other hand's vertices against the first one's D when the hand changes.
struct ImosCodeOptions {
  /// Number of frames whose object poses and fingers are given by the clip; the reference frame for
  /// D is chosen among them. 1 for Holdfast's clips, 4 for the authors'.
  int given_frames = 1;
  double tolerance = 1e-8;      ///< of cost, step and gradient, in the first stage
  int max_iterations = 100;     ///< of the first stage (theirs: 600 evaluations, 7 per iteration)
  int finger_steps = 160;       ///< of Adam, per frame
  double learning_rate = 5e-3;  ///< at the first step of a frame
  double learning_rate_decay = 0.99999;  ///< per step
  double lambda_contact = 0.005;         ///< on the mean distance of pairs in contact
  double lambda_drift = 0.005;  ///< on the fingers' mean squared displacement from their start
  double contact_threshold_m = 0.01;  ///< tau
};

/// Returns the reference frame of D: the last given one before the object moves by 1 mm, or the
/// last but one if it does not. (The code tests a signed difference along any axis, which ignores
/// upward motion; the distance is meant.)
int ImosReferenceFrame(const ObjectTrack& track, int given_frames);

/// First stage, one frame: minimizes over the object pose, from `pose`,
///   1/2 sum_ij ( |R o_j + T - v_i| - D_ij )^2
/// for the hand vertices of `state`. `distance` has weight 1. Returns the iterations, or -1 without
/// a usable solution (`pose` is then the start).
int FitImosObject(HandState& state, const HandObjectDistance& distance,
                  const ImosCodeOptions& options, ObjectPose& pose);

/// Fits the object in all frames by this algorithm. Arguments, result and errors as for FitClip
/// with one hand; for comparison, energies are the paper's, with its weights, at the solution.
FitResult FitClipImosCode(const Clip& clip, const HandModel& hand,
                          const Eigen::Matrix3Xd& object_vertices,
                          const ImosCodeOptions& options = {},
                          const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
