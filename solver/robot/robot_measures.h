// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// One frame of a transfer, measured on meshes, not on the solver's grids and samples.
struct RobotFrameMeasure {
  double hand_in_object_mm = 0.0;  ///< deepest point of the links' surfaces in the object
  double object_in_hand_mm = 0.0;  ///< deepest of the object's surface in a link
  double self_mm = 0.0;            ///< deepest of a link in another (RobotSolids::Pairs)
  /// RobotHold::Give_m where the human hand touches, else NaN.
  double give_mm = std::numeric_limits<double>::quiet_NaN();
  std::vector<RobotContact> contacts;

  double Deepest_mm() const;
  double ContactDistance_mm() const;  ///< mean; NaN without contacts
  double ContactAngle_deg() const;    ///< mean; NaN without contacts
};

struct RobotMeasures {
  std::vector<RobotFrameMeasure> frames;
  int hold_frames = 0;
  int contacts = 0;         ///< of all frames
  double contact_mm = 0.0;  ///< mean over them
  double angle_deg = 0.0;   ///< mean
  double press_deg = 0.0;   ///< RobotContact::press_rad, mean; NaN of a human hand
  /// RobotContact::bone_rad and bone_m, means over the phalanges that touch (TopoRetarget, Wu et
  /// al. 2026, eq. 11 and 10). NaN where none does.
  double bone_deg = 0.0, bone_mm = 0.0;
  int bones = 0;                 ///< that touch, of all frames
  double touching_ratio = 0.0;   ///< of contacts, those within 5 mm of the human's place
  double kept_ratio = 0.0;       ///< of contacts, those whose pad is within 5 mm of the object
  double deepest_mm = 0.0;       ///< of the clip
  double mean_deepest_mm = 0.0;  ///< frames' deepest, mean
  int frames_deeper_than_2_mm = 0;
  double self_mm = 0.0;  ///< deepest of the clip
  /// Median of the frames in which the human hand touches: how far the object's own weight moves it
  /// in the grip. NaN without such frames, and of a human hand.
  double give_mm = std::numeric_limits<double>::quiet_NaN();
};

/// Contacts: for each part of the human hand that touches (PartContact) and stands for something of
/// the robot, the point of the robot's pad of that part that is nearest to the human's place on the
/// object; its distance, and the angle of its normal to the object's reversed.
RobotMeasures MeasureTransfer(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                              int threads = 1);

/// The human hand by the same measure, so that one sees how near a hand can come to what is asked:
/// of each contact, the nearest point of the skin of its part. Deepest: its vertices in the object.
/// It presses where it touches and its bones are what others' are compared with: press_deg is NaN,
/// bones are none.
RobotMeasures MeasureHuman(const RobotTransferSetup& setup, int threads = 1);

/// Parts of the human hand ("index2") whose contact is lost (RobotContact::gap_m of 5 mm and more)
/// in most of the frames in which they touch, and in how many of how many frames.
struct LostPart {
  std::string part;
  int lost = 0, frames = 0;
};
std::vector<LostPart> LostParts(const RobotMeasures& measures);

nlohmann::json RobotMeasuresJson(const RobotMeasures& measures);
nlohmann::json RobotProtocolJson(const RobotTransferOptions& options);

}  // namespace holdfast
