// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/skeleton.h"

namespace holdfast {

/// Attachment of a marker to the body.
enum class MarkerTie {
  kSkin,      ///< on the skin; the name determines its position to about 1 cm
  kLandmark,  ///< on a bony landmark: anatomy gives its offset from the joint
  kCluster,   ///< on a rigid plate somewhere on the segment: position is estimated
};
std::string_view MarkerTieName(MarkerTie tie);

/// Nominal site of a marker: on the line from a joint to the next, offset outwards.
struct MarkerSite {
  std::string name;
  int joint = 0;                                      ///< that the marker follows
  int toward = -1;                                    ///< joint; -1: end of the limb
  double fraction = 0.0;                              ///< of the distance to `toward`
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();  ///< meters, axes of the T-pose
  MarkerTie tie = MarkerTie::kCluster;
  double sigma_m = 0.04;  ///< uncertainty of the position
  int vertex = -1;        ///< vertex of the body model; overrides the above
};

/// Sites by name, case-insensitive.
class MarkerTable {
 public:
  /// Names of upper-limb cluster sets, Plug-in Gait and related sets (CMU's Vicon set, CGM2), and a
  /// glove; listed in docs/markers.md.
  static const MarkerTable& Known();
  /// Returns this table extended by the sites of `other`, which replace sites of the same name.
  MarkerTable With(const MarkerTable& other) const;
  /// Reads comma-separated columns with a header: name and joint or vertex, optional cluster. A
  /// marker with a cluster is rigidly attached to the joint's bone at an unknown position; one with
  /// a vertex is on the skin there; one with only a joint is somewhere around it. `joint_of_vertex`
  /// belongs to the body. Throws Error with file and line.
  static MarkerTable Read(const std::filesystem::path& path,
                          const std::vector<int>& joint_of_vertex);

  void Add(MarkerSite site) { sites_.push_back(std::move(site)); }
  const MarkerSite* Find(std::string_view name) const;
  const std::vector<MarkerSite>& Sites() const { return sites_; }
  /// Returns the site with the most similar name, and the edit distance. Ignores case, "_", "-",
  /// "." and blanks; "right" and "left" equal R and L. Requires a nonempty table.
  std::pair<const MarkerSite*, int> Nearest(std::string_view name) const;

 private:
  std::vector<MarkerSite> sites_;
};

}  // namespace holdfast
