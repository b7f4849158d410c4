// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solver/hand/hand_axes.h"
#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// A robot's finger as three phalanges. Positions and directions: root's frame, hand straight.
struct RobotFinger {
  int human = kIndex;                     ///< the finger that it stands for (Finger)
  std::array<std::vector<int>, 3> links;  ///< of each phalanx, from the palm outwards
  std::array<Eigen::Vector3d, 4> nodes;   ///< where the phalanges begin, and the tip
  std::array<Eigen::Vector3d, 3> pads;    ///< where each touches, unit, across its bone

  double Length() const;
};

/// What is what in a robot's hand.
struct RobotAnatomy {
  Side side = Side::kRight;
  bool side_is_clear = true;  ///< its shape tells the side
  std::vector<int> palm_links;
  std::vector<RobotFinger> fingers;  ///< the thumb, then from the index finger outwards
  /// Columns: forward, across (towards the thumb's side), out of the palm; root's frame. As
  /// HandAxes of a human hand.
  Eigen::Matrix3d root_from_axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d knuckles = Eigen::Vector3d::Zero();  ///< mean of where fingers begin, no thumb
  double palm_width = 0.0;                             ///< first to last knuckle, meters
  double palm_length = 0.0;                            ///< knuckles to the heel, meters
  Eigen::VectorXd closed;  ///< each number of the hand where its finger is most bent; those that
                           ///< bend none, as straight
};

/// Finds palm, fingers and thumb in any hand: the palm is the last link that all fingers hang on; a
/// finger ends at a moving link that nothing movable hangs on; pads face where fingers bend; the
/// thumb is the one that points and bends least like the others; the rest are in order from the
/// thumb's side. Four fingers stand for thumb, index, middle and ring, three for thumb, index and
/// middle, two for thumb and index. Nothing is told by names. A hand whose shape does not tell its
/// side is taken as `if_unclear`. Throws Error for fewer than two fingers, and for more than five.
RobotAnatomy FindAnatomy(const RobotHand& hand, Side if_unclear = Side::kRight);

/// Which links stand for which part of the human hand, as the user says it.
struct PartLink {
  std::string part;  ///< "palm", "thumb1" ... "pinky3", by phalanx from the palm
  std::string link;
};

/// A table `part,link` (CSV with that head). Throws Error for other heads, parts and lines.
std::vector<PartLink> ReadCorrespondence(const std::filesystem::path& path);
/// The anatomy where it is said and not found. Throws Error (`source`) for links that are not
/// there, a link given twice, no thumb and fewer than two fingers.
RobotAnatomy AnatomyOf(const RobotHand& hand, const std::vector<PartLink>& parts,
                       const std::string& source, Side if_unclear = Side::kRight);
/// The table of an anatomy, for people to change: AnatomyOf of it gives the same links.
std::vector<PartLink> PartLinksOf(const RobotHand& hand, const RobotAnatomy& anatomy);

}  // namespace holdfast
