// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ceres/sized_cost_function.h>
#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/markers/hand_keypoints.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "geometry/retarget/retarget.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {

/// Keypoints of a posed hand in its wrist's frame, in the order of kNumKeypoints, and their
/// derivatives. From the bones of the hand's rest pose; tips are where the finger ends, less half
/// of its thickness.
class KeypointHand {
 public:
  explicit KeypointHand(const HandAxes& axes);

  using Points = Eigen::Matrix<double, 3, kNumKeypoints>;
  using Jacobian = Eigen::Matrix<double, 3 * kNumKeypoints, kHandDofs, Eigen::RowMajor>;
  /// Meters, `fingers` in radians; computes the Jacobian unless it is null.
  void Evaluate(const FingerPose& fingers, Points& points, Jacobian* jacobian) const;

  /// Sum of the lengths of its bones between keypoints, meters.
  double BoneLength() const { return bone_length_; }

 private:
  Eigen::Matrix<double, 3, kJointsPerHand> rest_;  // of each joint, from its parent
  Eigen::Matrix<double, 3, kNumFingers> tips_;     // from the last joint
  double bone_length_ = 0.0;
};

/// w (p + R k_i(P) - x_i) of each keypoint that was seen (zero for the others): 63 residuals.
/// Parameter blocks: rotation of the wrist (quaternion x, y, z, w), its position p (meters), finger
/// pose P (45, radians).
class KeypointTerm final : public ceres::SizedCostFunction<3 * kNumKeypoints, 4, 3, kHandDofs> {
 public:
  /// `hand` must outlive the term.
  KeypointTerm(const KeypointHand& hand, double weight) : hand_(hand), weight_(weight) {}
  /// Sets the keypoints of a frame (meters, NaN: not seen).
  void SetTargets(const Eigen::VectorXd& targets) { targets_ = targets; }
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const KeypointHand& hand_;
  double weight_;
  Eigen::VectorXd targets_;
};

struct KeypointOptions {
  std::optional<Side> side;               ///< empty: the one that fits
  const KeypointOrder* order = nullptr;   ///< null: the one that fits
  std::optional<UpAxis> up;               ///< of the file; empty: z, with a note
  std::optional<double> meters_per_unit;  ///< empty: by the size of the hand
  double rate_hz = 30.0;
};
/// Options of `solve` for keypoints. The program has one `--up` for them and for markers.
OptionTable OptionsOf(KeypointOptions& options);

struct KeypointReport {
  Side side = Side::kRight;
  std::string order;
  double meters_per_unit = 1.0;
  double size_ratio = 1.0;    ///< of the hand in the file to the model's
  double rms_mm = 0.0;        ///< from the keypoints, at the model's size
  double other_rms_mm = 0.0;  ///< of the best other order or side, for the same frames
  int gaps = 0;               ///< frames without a hand, filled
  double solve_ms = 0.0;
  std::vector<std::string> notes;
};

struct SolvedKeypoints {
  Clip clip;  ///< of a hand alone
  KeypointReport report;
};

/// Fits a hand to 21 keypoints, frame by frame (Ceres): finger angles within their ranges, wrist
/// free; each frame begins at the last one and is held to it a little. The keypoints are scaled
/// about the wrist to the size of the model, which a clip cannot store. Frames with fewer than six
/// keypoints get the pose between their neighbors.
///
/// Side, order and hand of a file with two are those that fit several frames best, unless given.
/// The clip's wrist turns about the file's axes, turned so that z is up. Throws Error, named
/// `where`: no frame with a hand, keypoints that fit no hand, a unit that cannot be told.
SolvedKeypoints SolveKeypoints(const std::vector<KeypointTable>& tables,
                               const KeypointOptions& options, const std::string& where,
                               const StagedProgress& progress = {});

}  // namespace holdfast
