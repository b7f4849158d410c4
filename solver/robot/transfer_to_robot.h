// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/clip/clip_body.h"
#include "geometry/parallel.h"
#include "solver/robot/hand_correspondence.h"
#include "solver/robot/human_demonstration.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

struct RobotTransferOptions {
  DemonstrationOptions demonstration;
  std::vector<PartLink> correspondence;  ///< empty: found (FindAnatomy)
  std::string correspondence_source;     ///< its file, for messages
  /// The wrist stays near where the human's is (the palms laid on each other), a centimeter and
  /// five degrees; else it is free, drawn there weakly.
  bool on_path = false;
  // Standard deviations of the terms.
  double distance_sigma_m = 0.02;     ///< E_d
  double contact_sigma_m = 0.001;     ///< a contact's place
  double contact_sigma_rad = 0.1;     ///< a contact's normal
  double penetration_sigma_m = 1e-4;  ///< both ways
  double margin_m = 3e-4;             ///< that surfaces keep
  double self_sigma_m = 3e-4;         ///< links in each other
  double change_sigma_rad = 0.15;     ///< of joints, between frames
  double change_sigma_m = 0.01;       ///< of the wrist in the object's frame, between frames
  int object_vertices = 128;          ///< of E_d
  int points = 160;                   ///< of the hand's skin, in E_d
  int max_iterations = 15;            ///< a frame
  int threads = 1;                    ///< for what is made once and the first frame's starts; the
                                      ///< result does not depend on it
};

/// A robot's contact in a frame, in the object's frame: where its link is nearest to a place that
/// the human touched.
struct RobotContact {
  int part = 0;  ///< of the human hand
  int link = 0;
  Eigen::Vector3d target = Eigen::Vector3d::Zero(), target_normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double distance_m = 0.0;  ///< point to target
  double angle_rad = 0.0;   ///< normal against the target's reversed
  double gap_m = 0.0;       ///< of its pad, wherever that is nearest, to the object
  /// The object's normal where the pad is nearest to it, to the target's. NaN of a human hand.
  double press_rad = std::numeric_limits<double>::quiet_NaN();
  /// The phalanx's bone, robot's to human's: directions and far ends. NaN of the palm and of a
  /// human hand.
  double bone_rad = std::numeric_limits<double>::quiet_NaN();
  double bone_m = std::numeric_limits<double>::quiet_NaN();
};

/// Made once for a robot and a clip; what transfers and baselines share.
struct RobotTransferSetup {
  RobotHand robot;
  RobotAnatomy anatomy;
  std::vector<SkinPair> pairs;
  RobotPads pads;
  std::unique_ptr<RobotSolids> solids;
  std::shared_ptr<const HandModel> human;
  std::unique_ptr<HandLandmarks> landmarks;
  std::unique_ptr<HandAxes> axes;
  HumanDemonstration demonstration;
  int contacts_left_out = 0;  ///< of all frames: of parts that the robot lacks
  TriangleMesh object;
  std::unique_ptr<SignedDistance> object_distance;
  std::unique_ptr<DistanceGrid> object_grid;
  Eigen::Matrix3Xd object_samples;   ///< for penetration
  Eigen::Matrix3Xd object_vertices;  ///< of E_d
  Eigen::Isometry3d wrist_from_root = Eigen::Isometry3d::Identity();
};

/// Throws Error for what ReadDemonstration, FindAnatomy and AnatomyOf do, and for a robot of the
/// other side than the hand that holds.
RobotTransferSetup PrepareRobotTransfer(const ClipScene& scene, RobotHand robot,
                                        const RobotTransferOptions& options);

struct RobotTransfer {
  std::vector<RobotPose> poses;  ///< per frame, in the object's frame
  double solve_ms = 0.0;         ///< all frames
  double start_ms = 0.0;         ///< the first frame's starts
  int iterations = 0;
  bool stopped = false;  ///< by the progress
};

/// The robot's hand in every frame: from several starts in the frame with most contacts, then frame
/// by frame to both ends, each from the last solution. As long as the human's grasp stays
/// (SameGrasp), so does the robot's.
RobotTransfer TransferToRobot(const RobotTransferSetup& setup, const RobotTransferOptions& options,
                              const StagedProgress& progress = {});

}  // namespace holdfast
