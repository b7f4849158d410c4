// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/robot/robot_hand.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {

/// A robot finger as three phalanges. Positions and directions: root's frame, straight hand.
struct RobotFinger {
  int human = kIndex;                     ///< corresponding human finger (Finger)
  std::array<std::vector<int>, 3> links;  ///< per phalanx, from the palm outwards
  std::array<Eigen::Vector3d, 4> nodes;   ///< proximal ends of the phalanges, and the tip
  std::array<Eigen::Vector3d, 3> pads;    ///< unit pad directions, perpendicular to the bones

  double Length() const;
};

/// Roles of the parts of a robot hand.
struct RobotAnatomy {
  Side side = Side::kRight;
  bool side_is_clear = true;  ///< whether the shape determines the side
  bool gripper = false;       ///< parallel fingers that close on each other
  std::vector<int> palm_links;
  std::vector<RobotFinger> fingers;  ///< the thumb, then the others from the index finger outwards
  /// Columns: forward, across (towards the thumb's side), out of the palm; root's frame. As
  /// HandAxes of a human hand.
  Eigen::Matrix3d root_from_axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d knuckles = Eigen::Vector3d::Zero();  ///< mean finger base, without thumb
  double palm_width = 0.0;                             ///< first to last knuckle, meters
  double palm_length = 0.0;                            ///< knuckles to heel, meters
  /// Straight; joints that close the fingers of a gripper, and sliding ones, at their other bound.
  Eigen::VectorXd open;
  Eigen::VectorXd closed;  ///< each value at the bound that bends its finger most; values that bend
                           ///< no finger, as straight
};

/// Finds palm, fingers and thumb: the palm is the last common ancestor of all fingers; a finger
/// ends at a moving link without moving descendants; pads face the bending direction; the thumb
/// points and bends least like the others; the rest are ordered from the thumb's side. Four fingers
/// map to thumb, index, middle and ring, three to thumb, index and middle, two to thumb and index
/// (until ChooseFingers). Names are not used. If the shape does not determine the side,
/// `if_unclear` is used. Throws Error for fewer than two or more than five fingers.
RobotAnatomy FindAnatomy(const RobotHand& hand, Side if_unclear = Side::kRight);

/// User-specified correspondence of a link to a part of the human hand.
struct PartLink {
  std::string part;  ///< "palm", "thumb1" ... "pinky3", phalanges numbered from the palm
  std::string link;
};

/// Reads a CSV table with header `part,link`. Throws Error for invalid headers, parts and lines.
std::vector<PartLink> ReadCorrespondence(const std::filesystem::path& path);
/// Builds the anatomy from a specified correspondence. Throws Error (`source`) for missing links, a
/// link given twice, no thumb, or fewer than two fingers.
RobotAnatomy AnatomyOf(const RobotHand& hand, const std::vector<PartLink>& parts,
                       const std::string& source, Side if_unclear = Side::kRight);
/// Returns the editable table of an anatomy: AnatomyOf of the table gives the same links.
std::vector<PartLink> PartLinksOf(const RobotHand& hand, const RobotAnatomy& anatomy);

}  // namespace holdfast
