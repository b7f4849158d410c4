// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/clip/clip_body.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "solver/robot/hand_correspondence.h"
#include "solver/robot/human_demonstration.h"
#include "solver/robot/robot_anatomy.h"
#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

struct RobotTransferOptions {
  std::optional<Side> side;              ///< default: the hand that holds longer
  std::vector<PartLink> correspondence;  ///< empty: found by FindAnatomy
  std::string correspondence_source;     ///< its file, for messages
  std::string contacts;  ///< file of contacts in place of the clip's (ReadContacts); empty: none
  /// Keep the wrist near the human's (palms aligned), within 1 cm and 5 degrees; otherwise it is
  /// free, with a weak prior there.
  bool on_path = false;
  int threads = 1;  ///< for setup and the first frame's starts; does not affect the result
};

/// Options of `transfer --robot`.
OptionTable OptionsOf(RobotTransferOptions& options);

/// A robot contact in one frame, in the object's frame: the robot's pad point nearest to a point
/// that the human touched.
struct RobotContact {
  int part = 0;  ///< of the human hand
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double distance_m = 0.0;  ///< to the human's point
  double angle_rad = 0.0;   ///< normal to the reversed object normal there
  double gap_m = 0.0;       ///< minimum distance of its pad to the object
  /// Object normal at the point nearest to the pad, to that at the human's. NaN for a human hand.
  double press_rad = std::numeric_limits<double>::quiet_NaN();
  /// Bone of the phalanx, robot versus human: angle of directions, distance of distal ends. NaN for
  /// the palm and for a human hand.
  double bone_rad = std::numeric_limits<double>::quiet_NaN();
  double bone_m = std::numeric_limits<double>::quiet_NaN();
};

/// Data computed once per robot and clip, shared by transfers and baselines.
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
  int contacts_left_out = 0;  ///< total over frames: contacts of parts that the robot lacks
  TriangleMesh object;
  std::unique_ptr<SignedDistance> object_distance;
  std::unique_ptr<DistanceGrid> object_grid;
  Eigen::Matrix3Xd object_samples;   ///< for penetration
  Eigen::Matrix3Xd object_vertices;  ///< of E_d
  Eigen::Isometry3d wrist_from_root = Eigen::Isometry3d::Identity();
};

/// Throws Error as ReadDemonstration, FindAnatomy and AnatomyOf do, and if the robot hand's side
/// differs from that of the holding hand.
RobotTransferSetup PrepareRobotTransfer(const ClipScene& scene, RobotHand robot,
                                        const RobotTransferOptions& options);

struct RobotTransfer {
  std::vector<RobotPose> poses;  ///< per frame, in the object's frame
  double solve_ms = 0.0;         ///< all frames
  double start_ms = 0.0;         ///< the first frame's starts
  int iterations = 0;
  bool stopped = false;  ///< by the progress callback
};

/// Solves the robot hand in every frame: from several starts in the frame with the most contacts,
/// then frame by frame to both ends, each from the last solution. While the human's grasp is
/// unchanged (SameGrasp), the robot's pose is reused.
RobotTransfer TransferToRobot(const RobotTransferSetup& setup, const RobotTransferOptions& options,
                              const StagedProgress& progress = {});

/// A robot hand and its poses, one per frame of the clip.
struct RobotInScene {
  const RobotTransferSetup* setup;
  const std::vector<RobotPose>* poses;
};

}  // namespace holdfast
