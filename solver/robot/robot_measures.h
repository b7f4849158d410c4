// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "solver/grip/grip.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Returns up to three contacts per link that is closer to the object than `touch_m`: its nearest
/// points that are a centimeter apart, in the root's frame, with zero force. `link` is the robot's
/// link index. (Two opposing fingers with one contact each would not bear any torque about them.)
std::vector<GripContact> TouchesOfRobot(const RobotTransferSetup& setup, const PosedRobot& posed,
                                        double touch_m);

/// Jacobian of the contact points with respect to q: 3 rows per contact, root's frame.
Eigen::MatrixXd ContactSlopes(const RobotState& state, const std::vector<GripContact>& contacts);

/// Grasp stability of a robot hand, by the compliance model of GripGive: links closer than 3 mm
/// press with a total of 8 object weights, at least 10 N; the object is solid with 500 kg/m^3, 0.05
/// to 0.5 kg; joints are springs of 3 N m per radian, or 1 N per millimeter; friction is 0.6.
/// Returns the object's displacement in the grasp under its own weight, meters; decimeters if it
/// falls.
double GiveInRobot_m(const RobotTransferSetup& setup, const PosedRobot& posed);

/// Measures of one transferred frame, on meshes rather than on the solver's grids and samples.
struct RobotFrameMeasure {
  double hand_in_object_mm = 0.0;  ///< deepest surface point of the links in the object
  double object_in_hand_mm = 0.0;  ///< deepest surface point of the object in a link
  double self_mm = 0.0;            ///< deepest penetration between links (RobotSolids::Pairs)
  /// GiveInRobot_m if the human hand is in contact, else NaN.
  double give_mm = std::numeric_limits<double>::quiet_NaN();
  std::vector<RobotContact> contacts;

  double Deepest_mm() const;
  double ContactDistance_mm() const;  ///< mean; NaN without contacts
  double ContactAngle_deg() const;    ///< mean; NaN without contacts
};

struct RobotMeasures {
  std::vector<RobotFrameMeasure> frames;
  int hold_frames = 0;
  int contacts = 0;         ///< total over all frames
  double contact_mm = 0.0;  ///< mean over contacts
  double angle_deg = 0.0;   ///< mean
  double press_deg = 0.0;   ///< mean of RobotContact::press_rad; NaN for a human hand
  /// Means of RobotContact::bone_rad and bone_m over the phalanges in contact (TopoRetarget, Wu et
  /// al. 2026, eq. 11 and 10). NaN if there are none.
  double bone_deg = 0.0, bone_mm = 0.0;
  int bones = 0;                 ///< phalanges in contact, total
  double touching_ratio = 0.0;   ///< fraction of contacts within 5 mm of the human's point
  double kept_ratio = 0.0;       ///< fraction of contacts whose pad is within 5 mm of the object
  double deepest_mm = 0.0;       ///< maximum over the clip
  double mean_deepest_mm = 0.0;  ///< mean of the per-frame maxima
  int frames_deeper_than_2_mm = 0;
  double self_mm = 0.0;  ///< maximum over the clip
  /// Object displacement in the grasp under its own weight: median over frames in which the human
  /// hand is in contact. NaN without such frames, and for a human hand.
  double give_mm = std::numeric_limits<double>::quiet_NaN();
};

/// Measures a transfer. Contacts: for each part of the human hand in contact (PartContact) that has
/// a robot counterpart, the point of that robot pad nearest to the human's contact point on the
/// object; its distance, and the angle of its normal to the reversed object normal.
RobotMeasures MeasureTransfer(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                              int threads = 1);

/// Applies the same measures to the human hand, as a reference for the accuracy that is attainable.
/// Contacts: nearest point of the part's skin. Depth: hand vertices in the object. press_deg is NaN
/// and there are no bones, because the human hand is the reference for both.
RobotMeasures MeasureHuman(const RobotTransferSetup& setup, int threads = 1);

/// Names the parts of the human hand whose contact is lost (RobotContact::gap_m of 5 mm or more) in
/// most of its contact frames: "index2 (3 of 5 frames)".
std::vector<std::string> LostParts(const RobotMeasures& measures);

nlohmann::json RobotMeasuresJson(const RobotMeasures& measures);
nlohmann::json RobotProtocolJson();

}  // namespace holdfast
