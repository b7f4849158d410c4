// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "generator/actions/face_marks.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/actions/action_choice.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/fit/fit_options.h"

namespace holdfast {

/// Number of one-handed grasps per action, number of them tried for a second hand, and number of
/// object vertices used for both.
inline constexpr int kGraspChoice = 14, kPairTries = 5, kPairVertices = 300;

/// Returns pairs of grasps, of the right hand and of the left one that takes over the object from
/// it (TransferGrasp), in front of the chest of an upright person; the upright object has the yaw
/// that suits both arms. The `tries` most comfortable right-hand grasps are tried; pairs that keep
/// both wrists within their limits are returned.
std::vector<std::pair<Grasp, Grasp>> FindGraspPairs(const HandModel& right_hand,
                                                    const HandModel& left_hand,
                                                    const ActionProp& prop,
                                                    const std::vector<Grasp>& right,
                                                    std::uint64_t seed, int tries);

/// An acting person of one shape: const and shared by clips.
class ActionActor {
 public:
  /// Throws Error for a body without a head or hands.
  ActionActor(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas);

  const BodyModel& Model() const { return *model_; }
  const Eigen::VectorXd& Betas() const { return betas_; }
  const BodyMeasures& Measures() const { return measures_; }
  const FaceMarks& Face() const { return face_; }
  const HandModel& Hand(Side side) const { return side == Side::kRight ? right_ : left_; }
  const ArmIk& Arm(Side side) const { return side == Side::kRight ? right_arm_ : left_arm_; }
  /// Signed distances of FaceMarks::head.
  const DistanceGrid& Head() const { return head_; }
  /// Skin that the object must not penetrate: all but forearms and hands, every other vertex.
  const BodySurface& Skin() const { return skin_; }
  /// Signed distances of the closed trunk in the frame of spine3 at rest: origin at the joint.
  const DistanceGrid& Trunk() const { return trunk_; }
  /// Skin of both forearms, every third vertex.
  const BodySurface& Forearms() const { return forearms_; }

 private:
  std::shared_ptr<const BodyModel> model_;
  Eigen::VectorXd betas_;
  BodyMeasures measures_;
  BodySurface surface_;
  FaceMarks face_;
  DistanceGrid head_, trunk_;
  HandModel right_, left_;
  BodySurface skin_, forearms_;
  ArmIk right_arm_, left_arm_;
};

/// An object of an action, as it is or mirrored (ReflectX): const and shared by clips.
struct ActionProp {
  std::string name;  ///< embedded name
  TriangleMesh mesh;
  SignedDistance surface;
  FitObject fit;
  ObjectMarks marks;
  Eigen::Matrix3Xd samples;  ///< a few hundred surface points, object frame
};

/// `simplified`: 300 vertices, for the fit.
ActionProp MakeActionProp(std::string name, const TriangleMesh& mesh,
                          const TriangleMesh& simplified, bool mirrored, int threads);

/// Grasps of one prop by one actor: right hand, and both hands at once.
struct ActionGrasps {
  /// `right`: FindActionGrasps of the prop; `pairs`: FindGraspPairs, if clips need both hands.
  ActionGrasps(const ActionActor& actor, const std::vector<Grasp>& right,
               const std::vector<std::pair<Grasp, Grasp>>& pairs);

  std::vector<ActionGrasp> single;  ///< one for each grasp of the right hand
  std::vector<ActionGrasp> paired;  ///< one for each pair: for offhand
};

}  // namespace holdfast
